"""Check that the textures of a scene fit into a worker's memory, before any worker reads them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from sqlalchemy import select
from sqlalchemy.orm import Session

from renderer.plan.strengths import effective
from schemas.errors import Problem
from schemas.pointers import pointer
from schemas.scene import MAPS, Scene, used_textures
from schemas.textures import ImageTexture
from service.storage.assets import PREFIX
from service.storage.database.models import AssetRow

WORKER_BYTES = 512 << 20
"""Address space of a worker without textures: 330 MiB before it reads a scene, and that of a tile."""
# Bytes of a pixel, counted from the arrays and confirmed with 8000 x 8000 pixels in each format: four floats,
# a third more with a pyramid, and what is beside them while one texture is read.
HELD_BYTES, WITH_PYRAMID, READ_BYTES = 16, 64 / 3, 16
GIB = 1 << 30


def too_large(session: Session, scene: Scene, worker_bytes: int) -> Problem | None:
    """Return the problem of textures that do not fit into a worker; None if they fit."""
    used = _used(effective(scene))
    sizes = _sizes(session, used)
    pixels = {texture: sizes[texture.asset] for texture in used if texture.asset in sizes}
    if not pixels:
        return None
    held = sum(
        count * (WITH_PYRAMID if texture.filter == "mipmap" else HELD_BYTES)
        for texture, count in pixels.items()
    )
    needed, room = held + READ_BYTES * max(pixels.values()), worker_bytes - WORKER_BYTES
    if needed <= room:
        return None
    largest = max(pixels, key=pixels.__getitem__)
    detail = (
        f"The textures of this scene take {needed / GIB:.1f} GiB of memory, and a worker has room for "
        f"{max(0, room) / GIB:.1f}. Make them smaller, this one first. The service's operator can raise "
        "worker_memory_bytes."
    )
    return Problem(
        pointer=pointer(["scene", "textures", used[largest], "asset"]), detail=detail, code="too_large"
    )


def _used(scene: Scene) -> dict[ImageTexture, str]:
    """The distinct images that shapes show, each with the name of one texture.

    Textures that differ only in their name are read once; one used as colour and as map is read twice.
    """
    shown = {shape.material for shape in scene.shapes}
    materials = {name: dict(found) for name, found in scene.materials.items() if name in shown}
    used: dict[ImageTexture, str] = {}
    for (*_, field), name in used_textures({"materials": materials}):
        texture = scene.textures.get(name) if isinstance(name, str) else None
        if isinstance(texture, ImageTexture):
            as_read = texture if field not in MAPS else texture.model_copy(update={"encoding": "linear"})
            used.setdefault(as_read, str(name))
    return used


def _sizes(session: Session, textures: Iterable[ImageTexture]) -> Mapping[str, int]:
    """Pixels of the pictures of textures, by the names of the assets."""
    hashes = {texture.asset.removeprefix(PREFIX) for texture in textures}
    query = select(AssetRow.sha256, AssetRow.width, AssetRow.height).where(AssetRow.sha256.in_(hashes))
    return {PREFIX + sha256: width * height for sha256, width, height in session.execute(query)}
