"""Which materials send rays on: mirrors and glass."""

import numpy as np

from renderer.materials.mirror import MirrorRays
from renderer.materials.transmission import TransmittedRays
from renderer.math.arrays import Floats
from renderer.plan import cost
from renderer.plan.brightness import faintest_weight
from renderer.plan.cost import COSTS
from renderer.plan.request import Request
from renderer.plan.stages import Spawner
from renderer.plan.surfaces import material_numbers
from schemas.pointers import escaped


def spawners(request: Request) -> tuple[Spawner, ...]:
    """Stages that send rays from points; none where no material that is shown asks for them."""
    stages: list[Spawner] = []
    faintest = faintest_weight(request)
    depths = np.array([request.document.materials[name].max_depth for name in request.names], dtype=np.int64)
    if _asked(request, "mirror", "mirror rays", "what mirrors show", rays=1):
        stages.append(MirrorRays(_numbers(request, "mirror"), depths, faintest))
    detail = "refracted rays, and reflected ones by Fresnel's formulas"
    if _asked(request, "transmission", "transmitted rays", detail, rays=3):
        strengths, indices = _numbers(request, "transmission"), _numbers(request, "ior")
        stages.append(TransmittedRays(strengths, indices, depths, material_numbers(request), faintest))
    return tuple(stages)


def transparent(request: Request) -> bool:
    """Whether light goes through some material that is shown."""
    return any(request.document.materials[name].transmission for name in request.names)


def _numbers(request: Request, part: str) -> Floats:
    return np.array(
        [getattr(request.document.materials[name], part) for name in request.names], dtype=np.float64
    )


def _asked(request: Request, part: str, stage: str, detail: str, rays: int) -> bool:
    """List the stage, and the materials that name it in vain; `rays` are expected for a point."""
    asking = []
    for name in request.names:
        material = request.document.materials[name]
        pointer = f"/materials/{escaped(name)}/{part}"
        if getattr(material, part) > 0:
            asking.append(pointer)
        elif part in material.model_fields_set:
            request.listing.leave_out(f"materials.phong.{part}", f"{pointer} is 0", (pointer,))
    if asking:
        share = len(asking) / len(request.names)
        price = cost.seconds(request.rays * share * rays, COSTS.bounce)
        request.listing.add(stage, f"materials.phong.{part}", detail, tuple(asking), price)
    return bool(asking)
