"""Admission: whether a request is accepted, before any picture is rendered for it."""

from __future__ import annotations

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
from schemas.shapes import MeshFile
from schemas.textures import ImageTexture
from service.access.principals import Principal
from service.jobs import uploads
from service.jobs.context import Service
from service.jobs.pricing import check_cost, target_of
from service.jobs.texture_memory import too_large
from service.jobs.worker_calls import ask_worker
from service.storage.assets import PREFIX, Kind, is_sha256, kind_of
from service.workers.planning import Outline, limited, outline, planning_seconds
from service.workers.tasks import PlanTask

Model = TypeVar("Model", bound=BaseModel)

_PHRASES = {Kind.PICTURE: "a picture", Kind.MESH: "a mesh", Kind.ARRAY: "an array of pixels (NPY)"}
WANTED = {
    Kind.PICTURE: f"a picture that can be used here. Use one of {', '.join(FORMATS)}.",
    Kind.MESH: "a mesh. Use OBJ, PLY or glTF (GLB).",
}


# More would block the event loop and all other clients of this process.
HERE_SECONDS = 0.2


@dataclass(frozen=True)
class Admitted:
    """A request that may be carried out."""

    request: JobRequest
    warnings: tuple[Problem, ...]
    outline: Outline
    description: PlanDocument
    target: TargetQuality | None


async def admit(service: Service, principal: Principal, body: bytes) -> Admitted:
    """Read, check, plan and price a user's request.

    Raises
    ------
    renderer.SceneError
        With every problem; pointers lead into the body.
    ServiceError
        As `ask_worker` raises it, if a worker plans it.
    """
    request, warnings = await service.read(principal.name, _read, service, principal, body)
    if planning_seconds(request) > HERE_SECONDS:
        _, found = await ask_worker(service, principal, _plan_task, body)
    else:
        settings = service.settings
        found = await service.read(principal.name, outline, request, settings.workers, settings.tile_size)
    return await service.read(principal.name, _admitted, service, request, warnings, found)


def _read(service: Service, principal: Principal, body: bytes) -> tuple[JobRequest, tuple[Problem, ...]]:
    request, warnings = read_request(service, principal, body, JobRequest)
    return limited(request), warnings


def _plan_task(service: Service, principal: Principal, body: bytes) -> PlanTask:
    return PlanTask(body, service.settings.workers, service.settings.tile_size, user=principal.name)


def _admitted(
    service: Service, request: JobRequest, warnings: tuple[Problem, ...], found: Outline
) -> Admitted:
    target, quoted = target_of(request), service.prices.get(request)
    description = found.description
    if quoted is not None:
        cost = description.cost.model_copy(update={"cpu_seconds": quoted})
        description = description.model_copy(update={"cost": cost})
    check_cost(description, target, service.settings)
    return Admitted(request, warnings, found, in_request(description, request), target)


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
    """Problems with assets, each at the first place that names it."""
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
    # A damaged asset has been set aside.
    return {PREFIX + sha256: kind for sha256, kind in kinds.items() if service.assets.find(sha256)}


def asset_problem(place: str, asset: str, known: Mapping[str, str], wanted: Sequence[Kind]) -> Problem | None:
    """Describe the problem of an asset that should be of one of these kinds."""
    if asset in known:
        kind = kind_of(known[asset])
        detail = f"This is {_PHRASES[kind]}, not {WANTED[wanted[0]]}"
        return None if kind in wanted else Problem(pointer=place, detail=detail, code="asset")
    if asset.startswith(PREFIX) and is_sha256(asset.removeprefix(PREFIX)):
        detail = "You have uploaded no such asset. Send it to /v1/assets first."
        return Problem(pointer=place, detail=detail, code="unknown_asset")
    detail = "Over HTTP an asset is 'sha256:' and the 64 lower-case hexadecimal digits of an uploaded file."
    return Problem(pointer=place, detail=detail, code="asset_name")
