"""Plans of requests before their files are read: small ones are made by the service, others by workers."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass

import renderer
from renderer import progressive, tiling
from renderer.adaptive.driver import Driver
from renderer.adaptive.forecast import Forecast, price
from schemas.api.jobs import JobRequest
from schemas.api.plans import PlanDocument
from schemas.api.previews import PREVIEW_QUALITY
from schemas.errors import Problem
from schemas.limits import Limits
from schemas.quality import TargetQuality
from schemas.scene import Scene
from schemas.shapes import Mesh, MeshFile, Shape
from schemas.tiles import Pass, Tile
from service.errors import RefusedError
from service.workers.tasks import numbered, pass_of

# More would keep a worker from jobs, for a picture that is replaced at the next edit.
MOST_PREVIEW_SECONDS = 10.0


@dataclass(frozen=True)
class Outline:
    """Description of a render before it begins, from its plan.

    Attributes
    ----------
    description : PlanDocument
        With the price; pointers lead into the scene.
    steps : tuple
        All of fixed quality, those of the first pass of target quality.
    error_unknown : str or None
        Why passes of fixed quality have no error.
    forecast : Forecast or None
        Of target quality, whose first pass has ``rays``.
    """

    description: PlanDocument
    width: int
    height: int
    numerics: dict[str, int]
    steps: tuple[tuple[Pass, Tile], ...]
    error_unknown: str | None = None
    forecast: Forecast | None = None
    rays: int = 0


def read_again(body: bytes) -> JobRequest:
    """Read a request that was checked before: no limit applies any more."""
    return limited(JobRequest.model_validate(json.loads(body)))


def limited(request: JobRequest) -> JobRequest:
    """Set the time limit of a job with a target error, whichever field has it."""
    quality, limit = request.quality, request.time_limit
    if not isinstance(quality, TargetQuality) or limit is None:
        return request
    limit = min(limit, quality.time_limit or limit)
    return request.model_copy(update={"quality": quality.model_copy(update={"time_limit": limit})})


def outline(request: JobRequest, workers: int, tile_size: int | None) -> Outline:
    """Plan a request without its files.

    Raises
    ------
    RefusedError
        If it cannot be rendered; pointers lead into the request.
    """
    return outline_of(compile_admitted(request), workers, tile_size)


def outline_of(plan: renderer.RenderPlan, workers: int, tile_size: int | None) -> Outline:
    """Describe the beginning of a render.

    Parameters
    ----------
    workers
        Those that share the tiles; what all of them can do in a time limit bounds the price.
    tile_size
        Pixels along a tile's side; by default the renderer chooses them for each pass.
    """
    described = plan.describe().model_copy(update={"cost": price(plan, workers)})
    common = described, plan.width, plan.height, plan.numerics
    if isinstance(plan.quality, TargetQuality):
        driver = Driver.begin(plan, workers, tile_size)
        tiles = tuple((pass_of(0), tile) for tile in numbered(driver.tiles()))
        return Outline(*common, tiles, forecast=driver.forecast(), rays=driver.estimate.rays_wanted())
    steps = ((pass_, tile) for pass_ in plan.passes for tile in tiling.tiles(plan, pass_, tile_size))
    return Outline(*common, tuple(steps), progressive.unknown_error(plan))


def compile_admitted(request: JobRequest) -> renderer.RenderPlan:
    """Compile a request's scene without its files; pointers of problems lead into the request."""
    try:
        scene = renderer.load_scene(outlined(request.scene), assets=Pixels())
        return renderer.compile_scene(scene, request.quality, layers=request.layers)
    except renderer.SceneError as error:
        moved = [found.model_copy(update={"pointer": f"/scene{found.pointer}"}) for found in error.errors]
        raise RefusedError(moved, error.more) from None


def check_preview(scene: Scene, workers: int) -> None:
    """Refuse a preview that takes too long, or cannot be rendered.

    Raises
    ------
    RefusedError
        Pointers lead into the request.
    """
    plan = compile_admitted(JobRequest(scene=scene, quality=PREVIEW_QUALITY))
    seconds = price(plan, workers).cpu_seconds
    if seconds > MOST_PREVIEW_SECONDS:
        detail = (
            f"Even a preview is predicted to take {seconds:.0f} CPU seconds, more than the "
            f"{MOST_PREVIEW_SECONDS:.0f} allowed. Render the scene as a job."
        )
        raise RefusedError([Problem(pointer="/scene", detail=detail, code="cost")])


def planning_seconds(request: JobRequest) -> float:
    """Predict what planning a request costs, in CPU seconds, mostly too high.

    Measured with spheres and with meshes of one triangle, separately and combined: target quality examines
    the lights of each shape, and bounces are followed to their full depth.
    """
    scene = request.scene
    shapes, lights = len(scene.shapes), len(scene.lights)
    seconds = 0.03 + 8e-6 * shapes + 1e-3 * lights + 2e-7 * shapes * lights
    meshes = sum(map(_is_mesh, scene.shapes))
    seconds += 6e-3 * meshes
    materials = scene.materials.values()
    if any(material.displacement_map for material in materials):
        seconds += 3e-4 * shapes + 0.7 * meshes
    deepest = max((found.max_depth for found in materials if found.mirror or found.transmission), default=0)
    if deepest:
        seconds += 5e-3 * deepest + 1.5e-3 * shapes
    if isinstance(request.quality, TargetQuality):
        seconds += 1e-2 * shapes + 1.6e-2 * lights + 4e-3 * shapes * lights
        seconds += 6e-9 * scene.camera.width * scene.camera.height
    return seconds


_CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
_MESH_TRIANGLES = 1024
"""Triangles that stand for a mesh: priced within a factor of two of a million of them."""
_SCENE_TRIANGLES = 200_000
"""Triangles that stand for all meshes of a scene together."""
WHITE = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4//8/AAX+Av4N70a4AAAAAElFTkSuQmCC"
"""One white pixel as a PNG file, in Base64."""


class Pixels:
    """One white pixel in place of each picture. Satisfies ``renderer.AssetSource``.

    What stands for the user's files is bounded here, so that no setting refuses it.
    """

    limits = Limits()

    def read(self, name: str) -> bytes:  # noqa: ARG002  (an interface)
        """Return the pixel, as a PNG file."""
        return base64.b64decode(WHITE)


def outlined(scene: Scene) -> Scene:
    """Return the scene with a few triangles in place of each mesh."""
    count = sum(_is_mesh(shape) for shape in scene.shapes)
    if not count:
        return scene
    triangles = ((0, 1, 2),) * min(_MESH_TRIANGLES, max(1, _SCENE_TRIANGLES // count))
    shapes = tuple(_stand_in(shape, triangles) for shape in scene.shapes)
    return scene.model_copy(update={"shapes": shapes})


def _is_mesh(shape: Shape) -> bool:
    return isinstance(shape, Mesh | MeshFile)


def _stand_in(shape: Shape, triangles: tuple[tuple[int, int, int], ...]) -> Shape:
    if not isinstance(shape, Mesh | MeshFile):
        return shape
    return Mesh(
        type="mesh", vertices=_CORNERS, triangles=triangles, smooth=shape.smooth, material=shape.material
    )
