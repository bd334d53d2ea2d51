"""Thin shapes and their shadows on the picture: pixels that nodes of a lattice or pilot samples may miss.

Rays from a light past thin shapes find where their shadows fall.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from renderer.accelerators.trees import in_tree
from renderer.adaptive.edges import STEP, EdgePositions, outline_of, positions_along, project, thin_positions
from renderer.adaptive.labels import dilate
from renderer.adaptive.lighting import PROBE_SIDE
from renderer.cameras import Pinhole, basis
from renderer.integrator import find_hits
from renderer.interaction import MISS, Rays
from renderer.lights.emitters import Emitter
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, lengths, unit
from renderer.plan.plan import RenderPlan
from renderer.shapes import Family

MAX_EDGE_RAYS, MAX_FAMILY_RAYS = 16, 512
"""Most rays that locate the shadow of an edge before others follow it pixel by pixel, and of a family's edges
together."""

MAX_EDGES = 128
"""Most edges of a family for each light, the longest ones."""

OUTLINE_RESOLUTION, OUTLINE_GAP = 512, 4
"""Triangles in a tree cast thin shadows where two silhouettes are `OUTLINE_GAP` pixels apart in a picture of
all of them from the light, `OUTLINE_RESOLUTION` pixels wide."""

MAX_WIDTH = 4.0
"""Width in pixels up to which pilot samples may miss a shadow or its end."""

MAX_PENUMBRA = 2.0
"""Width in pixels beyond which a penumbra is resolved by pilot samples."""

START_OFFSET = 2.0**-10
"""Distance behind an edge at which its rays begin, in lengths of the edge."""


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    """Edges (M,) of flat shapes, or the longest axes of the outlines of curved ones.

    Attributes
    ----------
    starts, ends : (3, M) float64
    widths : (M,) float64
        Approximate width of their shapes across them.
    """

    starts: Floats
    ends: Floats
    widths: Floats

    def part(self, chosen: Integers | Masks) -> "_Edges":
        """Select by indices or a mask."""
        return _Edges(self.starts[:, chosen], self.ends[:, chosen], self.widths[chosen])


def thin_pixels(camera: Pinhole, families: Iterable[Family], within: int) -> Integers:
    """Pixels (2, N) that parts of shapes narrower than twice `within` may touch, their blur included.

    Parts that are blurred more widely are found by nodes that are `within` pixels apart.
    """
    found = np.zeros((camera.height, camera.width), dtype=bool)
    for family in families:
        if family.edges():
            positions = thin_positions(camera, outline_of(family, camera.position), within)
            _mark(found, camera, positions, np.zeros(positions.edges.size), within)
        else:
            axes = _axes(family, camera.position)
            positions = positions_along(camera, axes.starts, axes.ends)
            _mark(found, camera, positions, axes.widths[positions.edges] / 2, within)
    rows, columns = np.nonzero(found)
    return np.stack((columns, rows))


def _mark(found: Masks, camera: Pinhole, positions: EdgePositions, halves: Floats, most: int) -> None:
    """Mark pixels up to `halves` (N,), in scene units, and the blur from positions; not if beyond `most`."""
    depths = positions.depths
    size = depths * (2 * camera.half_height / camera.height)
    whole = np.ceil((halves + camera.blur(depths)) / size)
    for reach in np.unique(whole[whole <= most]).astype(int).tolist():
        marks = np.zeros_like(found)
        columns, rows = positions.pixels[:, whole == reach]
        marks[rows, columns] = True
        found |= dilate(marks, reach)


def _axes(family: Family, place: Floats, weight: float = 1.0) -> _Edges:
    """Longest axes of the outlines of curved shapes from a position (3, 1), or a direction with weight 0.

    A box has the corners of an ellipsoid's hull, and their covariance is the ellipsoid's matrix.
    """
    corners = family.corners()
    centre = corners.mean(axis=0)
    away = corners - centre
    towards = unit(place - weight * centre)
    flat = away - towards * (away * towards).sum(axis=1, keepdims=True)
    squares, directions = np.linalg.eigh(np.einsum("vik,vjk->kij", flat, flat) / len(corners))
    _, half_widths, half_lengths = np.sqrt(np.maximum(squares.T, 0))
    along = half_lengths * directions[:, :, 2].T
    return _Edges(centre - along, centre + along, 2 * half_widths)


def shadow_pixels(plan: RenderPlan) -> Integers:
    """Pixels (3, N) that thin shadows may cross: column, row, and number of the shadowed shape."""
    found = [np.zeros((3, 0), dtype=np.int64)]
    for lighting in plan.lightings:
        light = lighting.emitter
        gap = max(lengths(light.first).item(), lengths(light.second).item()) / (PROBE_SIDE - 1)
        for edges in _casters(plan.geometry.families, light):
            found.append(_pixels(plan, light, edges))
            narrow = edges.part(edges.widths < gap)
            found += [_pixels(plan, point, narrow) for point in _rim(light) if narrow.widths.size]
    return np.unique(np.hstack(found), axis=1)


def _casters(families: Iterable[Family], light: Emitter) -> Iterator[_Edges]:
    """Silhouettes of flat shapes, and longest axes of curved ones, from the light."""
    for family in families:
        edges = _thin_edges(family, light) if family.edges() else _axes(family, light.centre, light.weight)
        order = np.argsort(-lengths(edges.ends - edges.starts), kind="stable")
        yield edges.part(order[:MAX_EDGES])


def _thin_edges(family: Family, light: Emitter) -> _Edges:
    """Silhouette edges of flat shapes from the light; of triangles in trees those where they are thin."""
    outline = outline_of(family, light.centre, light.weight)
    if in_tree(family):
        seen = thin_positions(_sight(family.corners(), light), outline, OUTLINE_GAP)
        outline = outline.part(np.unique(seen.edges))
    starts, ends, inner = outline.starts, outline.ends, outline.inner
    along = ends - starts
    long = lengths(along)
    # Degenerate triangles cast no shadow.
    heights = lengths(cross(along, inner - starts)) / np.where(long > 0, long, 1)
    return _Edges(starts, ends, heights).part(long > 0)


def _sight(corners: Floats, light: Emitter) -> Pinhole:
    """A camera at the light that frames corners (V, 3, K), if it is outside of them."""
    least, greatest = corners.min(axis=(0, 2))[:, None], corners.max(axis=(0, 2))[:, None]
    middle, size = (least + greatest) / 2, lengths(greatest - least).item()
    towards = light.centre - light.weight * middle
    distance = max(lengths(towards).item() if light.weight else 64 * size, size)
    right, up, forward = basis(-towards, np.eye(3)[:, [np.argmin(np.abs(towards))]])
    half = size / distance
    return Pinhole(
        middle - distance * forward, right, up, forward, half, half, OUTLINE_RESOLUTION, OUTLINE_RESOLUTION
    )


def _rim(light: Emitter) -> list[Emitter]:
    """Point lights at the corners, edges and centre of an area light."""
    steps = [(u, v) for u in (-0.5, 0.0, 0.5) for v in (-0.5, 0.0, 0.5)]
    return [replace(light, centre=light.centre + light.first * u + light.second * v) for u, v in steps]


def _pixels(plan: RenderPlan, light: Emitter, edges: _Edges) -> Integers:
    """Pixels (3, N) along the shadows of edges, where they are thin and hardly soft."""
    count = edges.widths.size
    rays = int(np.clip(MAX_FAMILY_RAYS // max(count, 1), 2, MAX_EDGE_RAYS))
    which, along = np.arange(count).repeat(rays), np.tile(np.linspace(0, 1, rays), count)
    places, shapes = coarse = _shadow(plan, light, edges.part(which), along)
    hit = (shapes != MISS).reshape(count, rays)
    gaps = np.hypot(*np.diff(places.reshape(2, count, rays), axis=2)) / STEP
    both, either = hit[:, 1:] & hit[:, :-1], hit[:, 1:] | hit[:, :-1]
    counts = np.where(both, np.minimum(gaps, plan.width + plan.height), rays * either)
    counts = counts.astype(np.int64).ravel()
    gap = np.arange(counts.size).repeat(counts)
    edge, first = np.divmod(gap, rays - 1)
    step = (np.arange(gap.size) - (np.cumsum(counts) - counts)[gap] + 1) / (counts[gap] + 1)
    fine = _shadow(plan, light, edges.part(edge), (first + step) / (rays - 1))
    places, shapes = (np.concatenate(each, axis=-1) for each in zip(coarse, fine, strict=True))
    return np.vstack((np.floor(places).astype(np.int64), shapes))[:, shapes != MISS]


def _shadow(plan: RenderPlan, light: Emitter, edges: _Edges, along: Floats) -> tuple[Floats, Integers]:
    """Trace rays from the light past edges (n,), each at a fraction (n,) of its length.

    Returns column and row (2, n) where they end, and the shapes (n,) that they hit; `interaction.MISS`
    outside the picture, and where the shadow is soft or wide.
    """
    edge = edges.ends - edges.starts
    places = edges.starts + along * edge
    away = light.weight * places - light.centre
    before = np.where(light.weight, lengths(away), np.inf)
    origins = places + START_OFFSET * lengths(edge) * unit(away)
    nothing = np.zeros(along.size, dtype=np.int64)
    rays = Rays(origins, unit(away), nothing, nothing)
    find_hits(plan, rays, lights=False)
    behind = np.where(rays.shapes != MISS, rays.t, 0.0)
    on_picture, depth, inside = project(plan.camera, origins + behind * rays.directions)
    pixel = 2 * plan.camera.half_height / plan.camera.height * depth
    width = edges.widths * (1 + behind / before)
    across = unit(cross(away, edge))
    extent = np.abs(dot(across, light.first)) + np.abs(dot(across, light.second))
    seen = inside & (width < MAX_WIDTH * pixel) & (extent * behind <= MAX_PENUMBRA * pixel * before)
    return on_picture, np.where(seen, rays.shapes, MISS)
