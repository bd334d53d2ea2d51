"""Hard cases: what a surface must not do to itself, and what must not be missed above it."""

import itertools
from collections.abc import Callable, Iterator

import numpy as np

import renderer
from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.documents import bulb, scene, sphere
from accuracy.hard_cases.plain_shadows import (
    STEP,
    ball_shades_itself,
    in_the_way,
    self_shadowed,
    stepped_over,
)
from accuracy.hard_cases.shadow_rooms import (
    WALLS,
    corner_targets,
    inner_lights,
    outer_lights,
    room,
    seen_in_room,
)
from accuracy.hard_cases.shadow_scenes import (
    COVERS,
    FLOORS,
    OFFSETS,
    PATTERNS,
    PRECISIONS,
    SCALES,
    Place,
    View,
    bare,
    covered,
    partly_covered,
    places,
)
from renderer.math.arrays import Masks

SECTION = Section("What is in the way")


def asked(views: Iterator[tuple[View, int, int]]) -> Outcome:
    """Ask about views in both precisions and all patterns in turn.

    Each comes with what the textbook gets wrong, in float64 and in float32.
    """
    outcomes = []
    for number, (view, double, single) in enumerate(views):
        wrong = view.wrong(PRECISIONS[number % 2], PATTERNS[number // 2 % 4])
        outcomes.append(Outcome(view.seen.size, wrong, double, single))
    return total(outcomes)


def _bare(step: Callable[[Place], float], **where: object) -> Iterator[tuple[View, int, int]]:
    for kind in FLOORS:
        height = 0.1 if kind == "relief" else 0.0
        for chosen, place in places(f"acne {kind}", **where):  # type: ignore[arg-type]
            view = bare(kind, place, chosen)
            double, single = (
                int(np.count_nonzero(self_shadowed(view, place, height, dtype, step(place))))
                for dtype in (np.float64, np.float32)
            )
            yield view, double, single


@SECTION.case(
    "a plane in its own shadow",
    symptom="Lit surfaces have dark speckles, more of them far from the origin and at flat angles.",
    cause="A hit is rounded to either side of its surface, so half of the shadow rays start behind it.",
    remedy="A flat surface is left out of its own occluders; a place that touches another plane is on the "
    "side that its ray came from. Nothing is stepped over.",
    expected="Every light is seen whole from bare floors, up to 10,000,000 sizes from the origin.",
    source="geometry; for the rounding bounds, Pharr, Jakob and Humphreys, Physically Based Rendering, 6.8",
)
def acne() -> Outcome:
    """Bare floors at all offsets, with nothing to step over."""
    return asked(_bare(lambda _: 0.0, offsets=OFFSETS))


@SECTION.case(
    "a ball in its own shadow",
    symptom="A ball has dark speckles on its lit side, more of them the farther it is from the origin.",
    cause="A hit is rounded to the inside of the ball, and the way out of it meets the ball again.",
    remedy="A ball shades its own outer side by the sign of one cosine: it is convex.",
    expected="A bulb is seen where the cosine is positive and not where it is negative, within 2^-48 times "
    "the distance from the origin in radii, up to 10,000,000 of them; radii 0.001 to 1,000.",
    source="geometry",
)
def own_ball() -> Outcome:
    """Balls of all sizes at all offsets; the textbook starts at the hit and takes t > 0."""
    outcomes = []
    for number, (offset, radius) in enumerate(itertools.product(OFFSETS, (1e-3, 1.0, 1e3))):
        ((chosen, place),) = places(f"ball {offset} {radius}", (offset,), (radius,))
        ball, other = (sphere(place.at(*np.full(3, way)).tolist(), radius) for way in (0.0, 90.0))
        light = place.at(3, 2, 1)
        origins = place.at(*chosen.normal(size=(3, 80)) * 5)
        written = scene(ball, other, lights=[bulb(light.tolist())])
        plan = renderer.compile_scene(renderer.load_scene(written), PRECISIONS[number % 2])
        hits = renderer.trace(plan, origins, place.center - origins)
        away = light - hits.position
        cosines = (hits.normal * away).sum(axis=1) / np.sqrt((away * away).sum(axis=1))
        doubt = 2.0**-48 * (1 + offset)
        wrong = (hits.visibility[:, 0] != (cosines > 0)) & (np.abs(cosines) > doubt) | (hits.shape != 0)
        plain = [ball_shades_itself(hits.position, place, light, dtype) for dtype in (np.float64, np.float32)]
        lit = cosines > 0
        outcomes.append(
            Outcome(80, int(np.count_nonzero(wrong)), *(int(np.count_nonzero(mask & lit)) for mask in plain))
        )
    return total(outcomes)


@SECTION.case(
    "a scene in other units",
    symptom="A scene written in other units loses its small shadows or gets speckles.",
    cause="A step of 0.0001 is a length: too short for a scene of kilometres, too long for micrometres.",
    remedy="No comparison has a length in it: each bound is a multiple of the numbers that it belongs to.",
    expected="Every light is seen whole in scenes from 1/1,048,576 to 1,048,576 times the size.",
    source="geometry",
)
def units() -> Outcome:
    """Bare floors of all sizes, with a fixed step."""
    return asked(_bare(lambda _: STEP, offsets=(0.0, 1e3), scales=SCALES))


@SECTION.case(
    "shadows in units of a power of two",
    symptom="In a small model shadows are missing; in a large one they have other outlines.",
    cause="What is nearer than a fixed length does not count, and how much that is depends on the unit.",
    remedy="No comparison has a length in it, so a scale that is exact changes no bit of any of them.",
    expected="Covers that end above a floor leave the same share of every light at 2^-20 and 2^20 times the "
    "size, bit for bit, in both precisions.",
    source="geometry (such a scale is exact)",
)
def powers_of_two() -> Outcome:
    """All floors under all covers; the textbook is asked whether the cover is in the way of a bulb."""
    outcomes = []
    for number, (kind, above) in enumerate(itertools.product(FLOORS, COVERS)):
        seen, plain = [], []
        for scale in (1.0, 2.0**-20, 2.0**20):
            ((chosen, place),) = places(f"power {kind} {above}", (1e2,), (scale,))
            view = partly_covered(kind, above, place, chosen)
            seen.append(view.hits(PRECISIONS[number % 2], PATTERNS[number // 2 % 4]).visibility)
            plain.append([_under(view, dtype) for dtype in (np.float64, np.float32)])
        wrong = sum(int(np.count_nonzero(other != seen[0])) for other in seen[1:])
        differ = [sum(int((other[i] != plain[0][i]).sum()) for other in plain[1:]) for i in (0, 1)]
        outcomes.append(Outcome(2 * seen[0].size, wrong, *differ))
    return total(outcomes)


def _under(view: View, dtype: type[np.floating]) -> Masks:
    """Rays (N,) at whose ends a textbook finds a flat cover between its step and the bulb."""
    above = view.shapes[view.floors :]
    if above[0]["type"] == "ellipsoid":
        return np.zeros(len(view.origins), dtype=bool)
    ends = view.origins + view.directions
    return in_the_way(above, ends, np.array(view.lights[0]["position"]) - ends, dtype, STEP)


@SECTION.case(
    "an occluder just above the floor",
    symptom="A shadow does not touch what casts it, or is missing under thin things.",
    cause="A shadow ray that starts some way off the surface jumps over what is nearer than that.",
    remedy="Shadow rays start on the surface itself, see above.",
    expected="No light is seen under covers at 0.001 to 0.9 of the way to it.",
    source="geometry",
)
def detached() -> Outcome:
    """Floors under covers; the textbook steps over a hundredth."""

    def views() -> Iterator[tuple[View, int, int]]:
        kinds = itertools.product(FLOORS[:3], COVERS, (1e-3, 0.03, 0.9))
        for kind, above, share in kinds:
            for chosen, place in places(f"detached {kind} {above} {share}", offsets=(0.0, 1e7)):
                view = covered(kind, above, share, place, chosen)
                double, single = (
                    int(np.count_nonzero(stepped_over(view, share, dtype, 1e-2)))
                    for dtype in (np.float64, np.float32)
                )
                yield view, double, single

    return asked(views())


@SECTION.case(
    "the corners of a room",
    symptom="Light from outside shines in along the lines where walls meet; mirrors there show black dots.",
    cause="Each wall rounds its own edge, and a gap of one rounding is left between two.",
    remedy="Edge functions of neighbours differ in sign alone, and edges are moved out by their rounding.",
    expected="At the corner lines, lights outside are never seen, and lights inside always are.",
    source="Woop, Benthin and Wald 2013; geometry",
)
def corners() -> Outcome:
    """Rooms of three kinds of walls, with and without a mirror; the textbook steps over what is near."""
    outcomes = []
    upright = Place(np.array([148376.0, 1234.0, -223423.0]), np.eye(3), 1.0)
    for number, (kind, mirrors) in enumerate(itertools.product(WALLS, ((), (0,)))):
        turned = places(f"corners {kind}", offsets=(0.0, 1e7))
        for chosen, place in itertools.chain(turned, [(np.random.default_rng(7), upright)]):
            shapes = room(kind, place, mirrors)
            for shining, dark in ((inner_lights(place), False), (outer_lights(place), True)):
                light = seen_in_room(
                    shapes,
                    place,
                    chosen,
                    PRECISIONS[number % 2],
                    shining=shining,
                    pattern=PATTERNS[number % 4],
                )
                outcomes.append(Outcome(light.size, int(np.count_nonzero((light == 0) != dark))))
            plain = [_plain_corners(kind, place, chosen, dtype) for dtype in (np.float64, np.float32)]
            outcomes.append(Outcome(0, 0, *plain))
    return total(outcomes)


def _plain_corners(kind: str, place: Place, chosen: np.random.Generator, dtype: type[np.floating]) -> int:
    """Bulbs in a room that a textbook does not see from its corner lines, and those outside that it does."""
    walls, corners = room(kind, place), place.at(*corner_targets(chosen, 6).T)
    inner, outer = (
        in_the_way(walls, corners, np.array(light["position"]) - corners, dtype, STEP)
        for light in (inner_lights(place)[0], outer_lights(place)[-1])
    )
    return int(np.count_nonzero(inner) + np.count_nonzero(~outer))
