"""What is told about each pixel beside its colour. The request asks for it, not the scene."""

from dataclasses import replace

from renderer.layers import LAYERS, Layer
from renderer.plan import cost
from renderer.plan.cost import COSTS
from renderer.plan.request import Request


def layers(request: Request) -> tuple[Layer, ...]:
    """The layers of a request; those that need to know what a pixel shows ask for rays of their own."""
    count = request.sampling.antialiasing.samples
    chosen = tuple(
        replace(LAYERS[name], ground=count) if name == "samples" else LAYERS[name] for name in request.layers
    )
    if any(layer.values for layer in chosen):
        camera = request.document.camera
        met = COSTS.shape * cost.met(sum(family.numbers.size for family in request.families))
        price = cost.seconds(camera.width * camera.height, COSTS.camera + met + COSTS.point)
        request.listing.add("rays of layers", "layers", "one ray through the centre of each pixel", (), price)
    for layer in chosen:
        request.listing.add(f"layer {layer.name}", f"layers.{layer.name}", layer.detail, ())
    return chosen
