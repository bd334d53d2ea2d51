"""Admission: whether a request is accepted, before any work is done for it."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from pydantic import BaseModel

import renderer
from renderer.images.reading import FORMATS
from schemas.api.jobs import JobRequest
from schemas.api.plans import PlanDocument
from schemas.api.request_pointers import in_request
from schemas.errors import Problem
from schemas.limits import Limits
from schemas.pointers import pointer
from schemas.quality import TargetQuality
from schemas.reading import read_document
from schemas.scene import Scene, also_named
from schemas.shapes import Mesh, MeshFile, Shape
from schemas.textures import ImageTexture
from service.access.principals import Principal
from service.jobs import uploads
from service.jobs.context import Service
from service.jobs.pricing import check_cost, priced, target_of
from service.jobs.texture_memory import too_large
from service.storage.assets import PREFIX, Kind, is_sha256, kind_of

Model = TypeVar("Model", bound=BaseModel)

_PHRASES = {Kind.PICTURE: "a picture", Kind.MESH: "a mesh", Kind.ARRAY: "an array of pixels (NPY)"}
WANTED = {
    Kind.PICTURE: f"a picture that can be used here. Use one of {', '.join(FORMATS)}.",
    Kind.MESH: "a mesh. Use OBJ, PLY or glTF (GLB).",
}


@dataclass(frozen=True)
class Admitted:
    """A request that may be carried out."""

    request: JobRequest
    warnings: tuple[Problem, ...]
    plan: renderer.RenderPlan
    description: PlanDocument
    target: TargetQuality | None


def admit(service: Service, principal: Principal, body: bytes) -> Admitted:
    """Read, check, compile and price a user's request.

    Raises
    ------
    renderer.SceneError
        With every problem; pointers lead into the body.
    """
    request, warnings = read_request(service, principal, body, JobRequest)
    request = _limited(request)
    plan = compile_admitted(request)
    target = target_of(request)
    description = priced(plan, service.prices.get(request), service.settings.workers)
    check_cost(description, target, service.settings)
    return Admitted(request, warnings, plan, in_request(description, request), target)


def _limited(request: JobRequest) -> JobRequest:
    """Set the time limit of a job with a target error, whichever field has it."""
    quality, limit = request.quality, request.time_limit
    if not isinstance(quality, TargetQuality) or limit is None:
        return request
    limit = min(limit, quality.time_limit or limit)
    return request.model_copy(update={"quality": quality.model_copy(update={"time_limit": limit})})


def read_request(
    service: Service, principal: Principal, body: bytes, model: type[Model], *, limits: Limits | None = None
) -> tuple[Model, tuple[Problem, ...]]:
    """Read a body that has a ``scene``, within the service's limits, and look for the user's files in it."""
    request, warnings = read_document(body, model, limits=limits or service.settings.limits)
    scene = getattr(request, "scene", None)
    assert isinstance(scene, Scene)
    unusable = _unusable_assets(service, principal, scene)
    if unusable:
        raise renderer.SceneError(unusable)
    _check_memory(service, scene)
    return request, warnings


def _check_memory(service: Service, scene: Scene) -> None:
    if not uploads.hashes_of(scene):
        return
    with service.database.reading() as session:
        problem = too_large(session, scene, service.settings.worker_memory_bytes)
    if problem is not None:
        raise renderer.SceneError([problem])


def compile_admitted(request: JobRequest) -> renderer.RenderPlan:
    """Compile a request's scene without its files; pointers of problems lead into the request."""
    try:
        scene = renderer.load_scene(outlined(request.scene), assets=Pixels())
        return renderer.compile_scene(scene, request.quality, layers=request.layers)
    except renderer.SceneError as error:
        moved = [found.model_copy(update={"pointer": f"/scene{found.pointer}"}) for found in error.errors]
        raise renderer.SceneError(moved, error.more) from None


def _unusable_assets(service: Service, principal: Principal, scene: Scene) -> list[Problem]:
    pictures = {
        pointer(["scene", "textures", name, "asset"]): texture.asset
        for name, texture in scene.textures.items()
        if isinstance(texture, ImageTexture)
    }
    meshes = {
        pointer(["scene", "shapes", number, "asset"]): shape.asset
        for number, shape in enumerate(scene.shapes)
        if isinstance(shape, MeshFile)
    }
    known = known_assets(service, principal, {*pictures.values(), *meshes.values()})
    return [*_problems(pictures, known, Kind.PICTURE), *_problems(meshes, known, Kind.MESH)]


def _problems(named: Mapping[str, str], known: Mapping[str, str], wanted: Kind) -> Iterator[Problem]:
    """What is wrong with assets, each at the first place that names it."""
    uses: dict[str, list[str]] = {}
    for place, asset in named.items():
        uses.setdefault(asset, []).append(place)
    for asset, (first, *others) in uses.items():
        problem = asset_problem(first, asset, known, (wanted,))
        if problem is not None:
            detail = problem.detail + also_named(len(others))
            yield problem.model_copy(update={"detail": detail})


def known_assets(service: Service, principal: Principal, assets: set[str]) -> dict[str, str]:
    """Return the media types of those assets that a user may use, by their names in scenes."""
    hashes = {asset.removeprefix(PREFIX) for asset in assets if asset.startswith(PREFIX)}
    wanted = {sha256 for sha256 in hashes if is_sha256(sha256)}
    if not wanted:
        return {}
    with service.database.reading() as session:
        kinds = uploads.usable(session, wanted, principal)
    # One whose file was damaged has been set aside.
    return {PREFIX + sha256: kind for sha256, kind in kinds.items() if service.assets.find(sha256)}


def asset_problem(place: str, asset: str, known: Mapping[str, str], wanted: Sequence[Kind]) -> Problem | None:
    """Say what is wrong with an asset, which should be of one of these kinds."""
    if asset in known:
        kind = kind_of(known[asset])
        detail = f"This is {_PHRASES[kind]}, not {WANTED[wanted[0]]}"
        return None if kind in wanted else Problem(pointer=place, detail=detail, code="asset")
    if asset.startswith(PREFIX) and is_sha256(asset.removeprefix(PREFIX)):
        detail = "You have uploaded no such asset. Send it to /v1/assets first."
        return Problem(pointer=place, detail=detail, code="unknown_asset")
    detail = "Over HTTP an asset is 'sha256:' and the 64 lower-case hexadecimal digits of an uploaded file."
    return Problem(pointer=place, detail=detail, code="asset_name")


_CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
_MANY = 1024
"""Triangles that stand for a mesh: priced within a factor of two of a million of them."""
_MOST = 200_000
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
    triangles = ((0, 1, 2),) * min(_MANY, max(1, _MOST // count))
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
