"""Pixels that thin shadows may cross, which pilot samples may miss.

Rays from a light past the edges of narrow shapes find where their shadows fall.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from renderer.accelerators.trees import in_tree
from renderer.adaptive.edges import STEP, outline_of, project, thin_positions
from renderer.adaptive.lighting import PROBE_SIDE
from renderer.cameras import Pinhole, basis
from renderer.integrator import find_hits
from renderer.interaction import MISS, Rays
from renderer.lights.emitters import Emitter
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, lengths, taken, unit
from renderer.plan.plan import RenderPlan
from renderer.shapes import Family
from renderer.shapes.family import Hulls
from renderer.shapes.triangles import Triangles

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

MAX_PENUMBRA, MAX_FAINT_PENUMBRA = 2.0, 8.0
"""Width in pixels beyond which a penumbra is resolved by pilot samples; the second for shapes thinner than
the gaps between the light points of pilot samples."""

START_OFFSET = 2.0**-10
"""Distance behind an edge at which its rays begin, in lengths of the edge."""


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    """Edges (M,) of shapes that cast shadows.

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


def shadow_pixels(plan: RenderPlan) -> Integers:
    """Pixels (3, N) that thin shadows may cross: column, row, and number of the shadowed shape."""
    found = [np.zeros((3, 0), dtype=np.int64)]
    for lighting in plan.lightings:
        light = lighting.emitter
        gap = max(lengths(light.first).item(), lengths(light.second).item()) / (PROBE_SIDE - 1)
        for edges in _casters(plan.geometry.families, light):
            found.append(_pixels(plan, light, edges, MAX_PENUMBRA))
            narrow = edges.part(edges.widths < gap)
            found += [
                _pixels(plan, point, narrow, MAX_FAINT_PENUMBRA)
                for point in _rim(light)
                if narrow.widths.size
            ]
    return np.unique(np.hstack(found), axis=1)


def _casters(families: Iterable[Family], light: Emitter) -> Iterator[_Edges]:
    """Edges of single shapes, silhouettes of triangles in trees, and longest axes of curved shapes."""
    for family in families:
        edges = _outline_edges(family, light) if in_tree(family) else _edges_of(family.hulls())
        order = np.argsort(-lengths(edges.ends - edges.starts), kind="stable")
        yield edges.part(order[:MAX_EDGES])


def _outline_edges(family: Triangles, light: Emitter) -> _Edges:
    """Silhouette edges of triangles from the light, where they are thin."""
    outline = outline_of(family, light.centre, light.weight)
    chosen = np.unique(thin_positions(_sight(family.vertices, light), outline, OUTLINE_GAP).edges)
    starts, ends, inner = (taken(part, chosen) for part in (outline.starts, outline.ends, outline.inner))
    along = ends - starts
    long = lengths(along)
    # Degenerate triangles cast no shadow.
    heights = lengths(cross(along, inner - starts)) / np.where(long > 0, long, 1)
    return _Edges(starts, ends, heights).part(long > 0)


def _sight(vertices: Floats, light: Emitter) -> Pinhole:
    """A camera at the light that frames vertices (3, 3, K), if it is outside of them."""
    least, greatest = vertices.min(axis=(0, 2))[:, None], vertices.max(axis=(0, 2))[:, None]
    middle, size = (least + greatest) / 2, lengths(greatest - least).item()
    towards = light.centre - light.weight * middle
    distance = max(lengths(towards).item() if light.weight else 64 * size, size)
    right, up, forward = basis(-towards, np.eye(3)[:, [np.argmin(np.abs(towards))]])
    half = size / distance
    return Pinhole(
        middle - distance * forward, right, up, forward, half, half, OUTLINE_RESOLUTION, OUTLINE_RESOLUTION
    )


def _edges_of(hulls: Hulls) -> _Edges:
    corners = hulls.corners
    if hulls.edges:
        first, second = corners[1] - corners[0], corners[2] - corners[0]
        longest = np.maximum(lengths(first), np.maximum(lengths(second), lengths(second - first)))
        starts, ends = (np.hstack([corners[pair[end]] for pair in hulls.edges]) for end in (0, 1))
        widths, sides = lengths(cross(first, second)) / np.where(longest > 0, longest, 1), len(hulls.edges)
        return _Edges(starts, ends, np.tile(widths, sides)).part(np.tile(longest > 0, sides))
    centre = corners.mean(axis=0)
    axes = np.stack([corners[-1] - corners[-1 - (1 << bit)] for bit in range(3)]) / 2
    sizes = np.sqrt((axes**2).sum(axis=1))
    axis = axes[np.argmax(sizes, axis=0), :, np.arange(sizes.shape[1])].T
    return _Edges(centre - axis, centre + axis, 2 * np.sort(sizes, axis=0)[1])


def _rim(light: Emitter) -> list[Emitter]:
    """Point lights at the corners, edges and centre of an area light."""
    steps = [(u, v) for u in (-0.5, 0.0, 0.5) for v in (-0.5, 0.0, 0.5)]
    return [replace(light, centre=light.centre + light.first * u + light.second * v) for u, v in steps]


def _pixels(plan: RenderPlan, light: Emitter, edges: _Edges, soft: float) -> Integers:
    """Pixels (3, N) along the shadows of edges, where they are thin with penumbrae of up to `soft` pixels."""
    count = edges.widths.size
    rays = int(np.clip(MAX_FAMILY_RAYS // max(count, 1), 2, MAX_EDGE_RAYS))
    which, along = np.arange(count).repeat(rays), np.tile(np.linspace(0, 1, rays), count)
    places, shapes = coarse = _shadow(plan, light, edges.part(which), along, soft)
    hit = (shapes != MISS).reshape(count, rays)
    gaps = np.hypot(*np.diff(places.reshape(2, count, rays), axis=2)) / STEP
    both, either = hit[:, 1:] & hit[:, :-1], hit[:, 1:] | hit[:, :-1]
    counts = np.where(both, np.minimum(gaps, plan.width + plan.height), rays * either)
    counts = counts.astype(np.int64).ravel()
    gap = np.arange(counts.size).repeat(counts)
    edge, first = np.divmod(gap, rays - 1)
    step = (np.arange(gap.size) - (np.cumsum(counts) - counts)[gap] + 1) / (counts[gap] + 1)
    fine = _shadow(plan, light, edges.part(edge), (first + step) / (rays - 1), soft)
    places, shapes = (np.concatenate(each, axis=-1) for each in zip(coarse, fine, strict=True))
    return np.vstack((np.floor(places).astype(np.int64), shapes))[:, shapes != MISS]


def _shadow(
    plan: RenderPlan, light: Emitter, edges: _Edges, along: Floats, soft: float
) -> tuple[Floats, Integers]:
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
    seen = inside & (width < MAX_WIDTH * pixel) & (extent * behind <= soft * pixel * before)
    return on_picture, np.where(seen, rays.shapes, MISS)
