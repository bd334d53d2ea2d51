"""Whether the textures of a scene fit into a worker's memory, before any worker reads them."""

from __future__ import annotations

from collections.abc import Mapping

from sqlalchemy import select
from sqlalchemy.orm import Session

from renderer.plan.strengths import effective
from schemas.errors import Problem
from schemas.pointers import pointer
from schemas.scene import Scene, used_textures
from schemas.textures import ImageTexture
from service.storage.assets import PREFIX
from service.storage.database.models import AssetRow

WORKER_BYTES = 512 << 20
"""Address space of a worker that has read no scene yet."""
# Bytes of a pixel, counted from the arrays: floats of three channels with their pyramid, a third more; the
# padded table of four channels that target quality looks up; what is beside them while one texture is read,
# which a texture of 8192 x 8192 confirmed; and while a bump map is turned into slopes, in float64.
HELD, TABLE, READ, SLOPES = 16, 16, 16, 88
GIB = 1 << 30


def too_large(session: Session, scene: Scene, worker_bytes: int, *, target: bool) -> Problem | None:
    """What is wrong with the textures that a scene uses; None if they fit.

    Parameters
    ----------
    target
        Whether the quality is an error: more is kept of each texture then.
    """
    scene = effective(scene)
    used = _used(scene)
    pixels = {name: count for name, count in _pixels(session, scene).items() if name in used}
    if not pixels:
        return None
    bumps = {material.bump_map for material in scene.materials.values()} if target else set()
    held = sum(pixels.values()) * (HELD + (TABLE if target else 0))
    beside = max(count * (SLOPES if name in bumps else READ) for name, count in pixels.items())
    needed, room = held + beside, worker_bytes - WORKER_BYTES
    if needed <= room:
        return None
    largest = max(pixels, key=pixels.__getitem__)
    detail = (
        f"The textures of this scene take {needed / GIB:.1f} GiB of memory, and a worker has room for "
        f"{max(0, room) / GIB:.1f}. Make them smaller, this one first. The service's operator can raise "
        "worker_memory_bytes."
    )
    return Problem(pointer=pointer(["scene", "textures", largest, "asset"]), detail=detail, code="too_large")


def _used(scene: Scene) -> set[str]:
    """Names of the textures that shapes show."""
    shown = {shape.material for shape in scene.shapes}
    materials = {name: dict(found) for name, found in scene.materials.items() if name in shown}
    return {name for _, name in used_textures({"materials": materials}) if isinstance(name, str)}


def _pixels(session: Session, scene: Scene) -> Mapping[str, int]:
    """Pixels of the scene's pictures, by the names of textures."""
    assets = {
        name: texture.asset.removeprefix(PREFIX)
        for name, texture in scene.textures.items()
        if isinstance(texture, ImageTexture)
    }
    query = select(AssetRow.sha256, AssetRow.width, AssetRow.height).where(
        AssetRow.sha256.in_(set(assets.values()))
    )
    sizes = {sha256: width * height for sha256, width, height in session.execute(query)}
    return {name: sizes[sha256] for name, sha256 in assets.items() if sha256 in sizes}
