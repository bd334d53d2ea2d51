"""Where edges of hard shadows run on the picture: a shadow, or its tip, may be thinner than a pixel.

The shadow that a light at L casts of a place q on a plane of height 0 is, in homogeneous coordinates,
h_L q - h_q L with heights h: linear in q (Blinn, "Me and My (Fake) Shadow", 1988). So an edge's shadow is a
straight line, and what of it lies on a flat shape and in the view are clips of one parameter.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from renderer.adaptive.edges import on_picture, within, within_view
from renderer.adaptive.lighting import CORNERS
from renderer.adaptive.outlines import SharedEdges
from renderer.cameras import Pinhole
from renderer.lights.emitters import Emitter
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, lengths, unit
from renderer.shapes.family import Hulls

STEP = 0.5
"""Distance of the places along a shadow's edge, pixels, as of other edges."""

SOFT = 2.0
"""Width in pixels beyond which penumbrae hide nothing between pilot samples."""

FAINT = 8.0
"""The same where shapes cast them that are thinner than the gaps between the light points of pilot samples,
which do not see them: the wider the penumbra, the less of the light such a shape hides."""

TOUCHING = 2.0**-30
"""Height over a plane, as a share of the light's, below which an edge lies in the plane."""

MOST_PAIRS = 1 << 15
"""Most pairs of an edge and a flat shape for each light: of very many flat shapes the largest count."""


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """Shadows (n,) of edges: homogeneous places in the camera's frame at either end.

    Attributes
    ----------
    starts, ends : (3, n) float64
        Right and up by half the picture's width and height, and depth; all times `weights`.
    weights : (2, n) float64
        Above 0.
    heights : (2, n) float64
        Of the edge over the plane, by the weights' unit.
    extents : (n,) float64
        Extent of the light across each edge: along it, a light may be as long as it likes.
    shapes : (n,) int64
        Numbers of the shapes that the shadows fall on.
    """

    starts: Floats
    ends: Floats
    weights: Floats
    heights: Floats
    extents: Floats
    shapes: Integers


def outline_edges(hulls: Hulls) -> tuple[Floats, Floats]:
    """Ends (3, n) of the edges that hulls cast shadows by; of curved shapes their longest axis."""
    corners = hulls.corners
    if hulls.edges:
        return tuple(np.hstack([corners[pair[end]] for pair in hulls.edges]) for end in (0, 1))  # type: ignore[return-value]
    centre = corners.mean(axis=0)
    axes = _axes(corners)
    longest = np.argmax((axes**2).sum(axis=1), axis=0)
    axis = axes[longest, :, np.arange(corners.shape[2])].T
    return centre - axis, centre + axis


def shadow_edge_places(
    camera: Pinhole, lights: list[Emitter], hulls: list[Hulls], trees: list[SharedEdges]
) -> Integers:
    """Pixels that edges of hard shadows pass, (3, N): column, row and number of the shape they fall on.

    Parameters
    ----------
    camera : Pinhole
    lights : list of Emitter
        One with an area casts shadows as its centre does.
    hulls : list of Hulls
        What casts shadows. They fall on those that have edges: triangles and parallelograms.
    trees : list of SharedEdges
        Triangles that cast them by their outline alone.
    """
    flats = [(hull.corners, hull.numbers) for hull in hulls if hull.edges]
    found = [np.zeros((3, 0), dtype=np.int64)]
    for light in lights if flats else ():
        gap = max(lengths(light.first).item(), lengths(light.second).item()) / (CORNERS - 1)
        for points, narrow, soft in (([light], np.inf, SOFT), (_rim(light), gap, FAINT)):
            for starts, ends in (_edges_of(hulls, narrow), *_outlines_of(trees, light, narrow)):
                if not starts.size:
                    continue
                largest = _largest(flats, MOST_PAIRS // (starts.shape[1] * len(points)))
                for point in points:
                    for corners, numbers in largest:
                        lines = _shadows(camera, point, starts, ends, corners, numbers)
                        found.append(_pixels(camera, lines, soft))
    return np.unique(np.hstack(found), axis=1)


def _outlines_of(trees: list[SharedEdges], light: Emitter, narrow: float) -> Iterator[tuple[Floats, Floats]]:
    """Ends (3, M) of the outline of each tree, where its triangles are narrower than something."""
    for tree in trees:
        outline = tree.outline(light.centre, light.weight)
        along = outline.ends - outline.starts
        across = lengths(cross(along, outline.inner - outline.starts))
        chosen = across < narrow * lengths(along)
        yield outline.starts[:, chosen], outline.ends[:, chosen]


def _largest(flats: list[tuple[Floats, Integers]], count: int) -> list[tuple[Floats, Integers]]:
    """The largest flat shapes: most of a picture's shadows fall on these."""
    areas = [lengths(cross(corners[1] - corners[0], corners[2] - corners[0])) for corners, _ in flats]
    least = np.sort(np.hstack(areas))[::-1][: max(count, 1)].min()
    return [
        (flat[0][..., area >= least], flat[1][area >= least]) for flat, area in zip(flats, areas, strict=True)
    ]


def _rim(light: Emitter) -> list[Emitter]:
    """Points at the rim of a light with an area, each as a light."""
    steps = [(u, v) for u in (-0.5, 0.0, 0.5) for v in (-0.5, 0.0, 0.5)]
    return [replace(light, centre=light.centre + light.first * u + light.second * v) for u, v in steps]


def _edges_of(hulls: list[Hulls], narrow: float) -> tuple[Floats, Floats]:
    """Ends (3, M) of the edges of hulls that are narrower than something."""
    ends = [outline_edges(_chosen(hull, _least_width(hull) < narrow)) for hull in hulls]
    starts, others = zip(*ends, strict=True)
    return np.hstack(starts), np.hstack(others)


def _chosen(hulls: Hulls, chosen: Masks) -> Hulls:
    return replace(hulls, numbers=hulls.numbers[chosen], corners=hulls.corners[..., chosen])


def _least_width(hulls: Hulls) -> Floats:
    """About the width (K,) of hulls: the second longest axis, or the area over the length."""
    corners = hulls.corners
    if hulls.edges:
        first, second = corners[1] - corners[0], corners[2] - corners[0]
        longest = np.maximum(lengths(first), np.maximum(lengths(second), lengths(second - first)))
        width = lengths(cross(first, second)) / np.maximum(longest, np.finfo(np.float64).tiny)
        return np.asarray(width)
    return np.sort(2 * np.sqrt((_axes(corners) ** 2).sum(axis=1)), axis=0)[1]


def _axes(corners: Floats) -> Floats:
    """Semi-axes (3, 3, K) of boxes (8, 3, K)."""
    return np.stack([corners[-1] - corners[-1 - (1 << bit)] for bit in range(3)]) / 2


def _shadows(
    camera: Pinhole, light: Emitter, starts: Floats, ends: Floats, corners: Floats, numbers: Integers
) -> _Lines:
    """Shadows of edges (3, M) on flat shapes (V, 3, R), clipped to these and to the view."""
    origin, first, second = corners[0], corners[1] - corners[0], corners[2] - corners[0]
    normal = cross(first, second)
    lit = light.centre - light.weight * origin
    heights_of_light = dot(normal, lit)
    turned = np.where(heights_of_light < 0, -1.0, 1.0)
    normal, top = normal * turned, heights_of_light * turned
    duals = cross(second, normal), cross(normal, first)
    duals = duals[0] / dot(duals[0], first), duals[1] / dot(duals[1], second)
    ends_found = []
    for places in (starts, ends):
        away = places[:, :, None] - origin[:, None, :]
        height = dot(normal[:, None, :], away)
        shadow = top * away - height * lit[:, None, :]
        weight = top - light.weight * height
        u, v = (dot(dual[:, None, :], shadow) for dual in duals)
        beyond = (weight - u, weight - v) if corners.shape[0] == 4 else (weight - u - v,)
        seen = shadow + (origin - camera.position)[:, None, :] * weight
        space = np.stack(
            (
                dot(camera.right[:, :, None], seen) / camera.half_width,
                dot(camera.up[:, :, None], seen) / camera.half_height,
                dot(camera.forward[:, :, None], seen),
            )
        )
        kept = np.stack((height - TOUCHING * top, weight - TOUCHING * top, u, v, *beyond))
        ends_found.append((space, np.stack((height, weight)), kept))
    (a, one, inside_a), (b, other, inside_b) = ends_found
    enters, leaves = within(inside_a, inside_b)
    clip_a, clip_b = within_view(a, b)
    enters, leaves = np.maximum(enters, clip_a), np.minimum(leaves, clip_b)
    edge, flat = np.nonzero((enters < leaves) & (top > 0))
    t = np.stack((enters[edge, flat], leaves[edge, flat]))
    clipped = [a[:, edge, flat] + side * (b - a)[:, edge, flat] for side in t]
    measures = np.stack([one[:, edge, flat] + side * (other - one)[:, edge, flat] for side in t], axis=1)
    extents = _extents_across(light, starts, ends)[edge]
    return _Lines(clipped[0], clipped[1], measures[1], measures[0], extents, numbers[flat])


def _extents_across(light: Emitter, starts: Floats, ends: Floats) -> Floats:
    """Extent (M,) of a light across the plane through its centre and each edge (3, M).

    Other points of that plane cast the same shadow of the edge.
    """
    across = unit(cross(light.centre - light.weight * starts, ends - starts))
    extent: Floats = np.abs(dot(across, light.first)) + np.abs(dot(across, light.second))
    return extent * light.weight


def _pixels(camera: Pinhole, lines: _Lines, soft: float) -> Integers:
    """Pixels along lines, where the penumbra around them is narrow."""
    size = np.array([[camera.width], [camera.height]])
    tiny = np.finfo(np.float64).tiny
    x, y = np.stack([on_picture(camera, places) for places in (lines.starts, lines.ends)], axis=1)
    counts = (np.hypot(x[1] - x[0], y[1] - y[0]) / STEP).astype(np.int64) + 2
    line = np.arange(counts.size).repeat(counts)
    along = (np.arange(line.size) - (np.cumsum(counts) - counts)[line]) / (counts - 1)[line]
    # Steps are even on the picture; there the parameter in space runs by the other end's depth.
    near, far = lines.starts[2, line], lines.ends[2, line]
    t = along * near / np.maximum(along * near + (1 - along) * far, tiny)
    weight, height, depth = (
        (1 - t) * pair[0][line] + t * pair[1][line]
        for pair in (lines.weights, lines.heights, (lines.starts[2], lines.ends[2]))
    )
    # Similar triangles: the penumbra is to the light as the way behind the edge is to the way before it.
    pixel = 2 * camera.half_height / camera.height * depth / np.maximum(weight, tiny)
    hard = lines.extents[line] * height <= soft * pixel * np.maximum(weight, tiny)
    places = np.stack([value[0][line] + along * (value[1] - value[0])[line] for value in (x, y)])
    pixels = np.clip(np.floor(places).astype(np.int64), 0, size - 1)
    return np.vstack((pixels, lines.shapes[line]))[:, hard]
