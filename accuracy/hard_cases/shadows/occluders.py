"""Hard cases E: what a surface must not do to itself, and what must not be missed above it."""

import itertools
import math
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases.documents import Json, bulb, lamp, rectangle, sampled, scene, sphere
from accuracy.hard_cases.harness import (
    QUALITIES,
    Cases,
    Outcome,
    Outcomes,
    compiled,
    in_both,
    plain_only,
    tally,
)
from accuracy.hard_cases.shadows.plain import (
    STEP,
    ball_shades_itself,
    in_the_way,
    self_shadowed,
    stepped_over,
)
from accuracy.hard_cases.shadows.scenes import (
    COVERS,
    EYE,
    FLOORS,
    OFFSETS,
    PATTERNS,
    SCALES,
    SHARES,
    WALLS,
    Place,
    View,
    bare,
    corner_targets,
    covered,
    grid,
    inner_lights,
    outer_lights,
    partly_covered,
    places,
    room,
    seen_in_room,
    triangulated,
    wall,
)
from renderer.math.arrays import Floats, Masks


def asked(views: Iterable[tuple[View, list[int]]]) -> Outcomes:
    """Ask about views in both precisions and all patterns in turn; each comes with the textbook's errors."""
    return (
        Outcome(view.seen.size, view.wrong(QUALITIES[number % 2], PATTERNS[number // 2 % 4]), *plain)
        for number, (view, plain) in enumerate(views)
    )


def _bare(step: float, **where: Any) -> Iterator[tuple[View, list[int]]]:
    for kind in FLOORS:
        height = 0.1 if kind == "relief" else 0.0
        for chosen, place in places(f"acne {kind}", **where):
            view = bare(kind, place, chosen)
            shadowed = partial(self_shadowed, view, place, height, step=step)
            yield view, [tally(each) for each in in_both(shadowed)]


def own_ball() -> Iterator[Outcomes]:
    """Balls of all sizes at all offsets; the textbook starts at the hit and takes t > 0."""
    for number, (offset, radius) in enumerate(itertools.product(OFFSETS, (1e-3, 1.0, 1e3))):
        ((chosen, place),) = places(f"ball {offset} {radius}", (offset,), (radius,))
        ball, other = (sphere(place.at(*np.full(3, way)), radius) for way in (0.0, 90.0))
        light = place.at(3, 2, 1)
        origins = place.at(*chosen.normal(size=(3, 80)) * 5)
        plan = compiled(scene(ball, other, lights=[bulb(light)]), QUALITIES[number % 2])
        hits = renderer.trace(plan, origins, place.center - origins)
        away = light - hits.position
        cosines = (hits.normal * away).sum(axis=1) / np.sqrt((away * away).sum(axis=1))
        doubt = 2.0**-48 * (1 + offset)
        wrong = (hits.visibility[:, 0] != (cosines > 0)) & (np.abs(cosines) > doubt) | (hits.shape != 0)
        plain = in_both(partial(ball_shades_itself, hits.position, place, light))
        yield Outcome(80, tally(wrong), *(tally(mask & (cosines > 0)) for mask in plain))


def powers_of_two() -> Iterator[Outcomes]:
    """All floors under all covers; the textbook is asked whether the cover is in the way of a bulb."""
    for number, (kind, above) in enumerate(itertools.product(FLOORS, COVERS)):
        seen, plain = [], []
        for scale in (1.0, 2.0**-20, 2.0**20):
            ((chosen, place),) = places(f"power {kind} {above}", (1e2,), (scale,))
            view = partly_covered(kind, above, place, chosen)
            seen.append(view.hits(QUALITIES[number % 2], PATTERNS[number // 2 % 4]).visibility)
            plain.append(in_both(partial(_under, view)))
        wrong = sum(tally(other != seen[0]) for other in seen[1:])
        differ = [sum(tally(other[i] != plain[0][i]) for other in plain[1:]) for i in (0, 1)]
        yield Outcome(2 * seen[0].size, wrong, *differ)


def _under(view: View, dtype: type[np.floating]) -> Masks:
    """Rays (N,) at whose ends a textbook finds a flat cover between its step and the bulb."""
    above = view.shapes[view.floors :]
    if above[0]["type"] == "ellipsoid":
        return np.zeros(len(view.origins), dtype=bool)
    ends = view.origins + view.directions
    return in_the_way(above, ends, np.array(view.lights[0]["position"]) - ends, dtype, STEP)


def detached() -> Outcomes:
    """Floors under covers; the textbook steps over a hundredth."""

    def views() -> Iterator[tuple[View, list[int]]]:
        for kind, above, share in itertools.product(FLOORS[:3], COVERS, (1e-3, 0.03, 0.9)):
            for chosen, place in places(f"detached {kind} {above} {share}", offsets=(0.0, 1e7)):
                view = covered(kind, above, share, place, chosen)
                over = in_both(partial(stepped_over, view, share, step=1e-2))
                yield view, [tally(each) for each in over]

    return asked(views())


def corners() -> Iterator[Outcomes]:
    """Rooms of three kinds of walls, with and without a mirror; the textbook steps over what is near."""
    yield (_five_walls(kind, number) for number, kind in enumerate(WALLS))
    upright = Place(np.array([148376.0, 1234.0, -223423.0]), np.eye(3), 1.0)
    for number, (kind, mirrors) in enumerate(itertools.product(WALLS, ((), (0,)))):
        turned = places(f"corners {kind}", offsets=(0.0, 1e7))
        for chosen, place in itertools.chain(turned, [(np.random.default_rng(7), upright)]):
            seen = partial(seen_in_room, room(kind, place, mirrors), place, chosen, QUALITIES[number % 2])
            for shining, dark in ((inner_lights(place), False), (outer_lights(place), True)):
                light = seen(shining=shining, pattern=PATTERNS[number % 4])
                yield Outcome(light.size, tally((light == 0) != dark))
            targets = place.at(*corner_targets(chosen, 6).T)
            yield plain_only(*in_both(partial(_plain_corners, kind, place, targets)))


POINTS = 64
"""Light points of each lamp behind a wall."""


def _five_walls(kind: str, number: int) -> Iterator[Outcomes]:
    """Points of lights behind an open room's walls that its corner lines see, and lines that are not hit."""
    for turn, (chosen, place) in enumerate(places(f"five walls {kind}", offsets=(0.0, 1e7))):
        walls = [shape for wall_ in range(1, 6) for shape in wall(kind, place, wall_, "plain")]
        lights = [
            lamp(place.at(-2, -2, 1.25), place.way(4, 0, 0), place.way(0, 4, 0), visible=False),
            lamp(place.at(1.25, -2, -0.9), place.way(0, 4, 0), place.way(0, 0, 2), visible=False),
        ]
        sampling = sampled(1, POINTS, light=PATTERNS[(number + turn) % 4])
        plan = compiled(scene(*walls, lights=lights, sampling=sampling), QUALITIES[number % 2])
        lines = corner_targets(chosen, 12)
        targets, eye = place.at(*lines[lines[:, 2] > OPEN].T), place.at(*EYE)
        hits = renderer.trace(plan, np.broadcast_to(eye, targets.shape), targets - eye)
        shadow_rays = POINTS * hits.visibility.size
        yield Outcome(shadow_rays, tally(hits.visibility) + tally(hits.shape < 0))


OPEN = -0.75
"""Third coordinate above which a ray from the eye to a line hits its wall, not the side without one."""


def _plain_corners(kind: str, place: Place, targets: Floats, dtype: Any) -> int:
    """Bulbs in a room that a textbook does not see from its corner lines, and those outside that it does."""
    inner, outer = (
        in_the_way(room(kind, place), targets, np.array(light["position"]) - targets, dtype, STEP)
        for light in (inner_lights(place)[0], outer_lights(place)[-1])
    )
    return tally(inner) + tally(~outer)


ANGLES = (90.0, 50.0, 20.0, 1.0)
"""Between the outer two of three walls, degrees."""


def sharp_corners() -> Outcomes:
    """A bulb and a lamp, seen flat by both walls; of the bulb, the textbook steps over what is near."""

    def views() -> Iterator[tuple[View, list[int]]]:
        for kind, degrees in itertools.product(WALLS, ANGLES):
            for chosen, place in places(f"sharp {kind} {degrees}", offsets=(0.0, 1e3, 1e7)):
                view = _wedge(kind, math.radians(degrees), place, chosen)
                foot = view.origins + view.directions
                ways = np.array(view.lights[0]["position"]) - foot
                blocked = in_both(partial(in_the_way, view.shapes, foot, ways, step=STEP))
                yield view, [tally(~each) for each in blocked]

    return asked(views())


def _wedge(kind: str, angle: float, place: Place, chosen: np.random.Generator) -> View:
    """Rays from between the outer walls at the foot of the one between them, with lights behind."""
    walls = [wall for share in (0, 1, 0.45) for wall in rising(kind, place, share * angle)]
    away, within = math.pi + angle / 2, angle * chosen.choice([0.2, 0.8])
    behind = place.at(5 * math.cos(away), 5 * math.sin(away), 0.3).tolist()
    edges = place.way(0, 0, 0.8), place.way(-0.3 * math.sin(away), 0.3 * math.cos(away), 0)
    lights = [bulb(behind), lamp(behind, *edges, two_sided=True)]
    foot = place.at(10.0 ** chosen.uniform(-17, -14, 40), 0, chosen.uniform(-3, 3, 40))
    eye = np.tile(place.at(2.5 * math.cos(within), 2.5 * math.sin(within), 0.2), (40, 1))
    return View(walls, lights, len(walls), eye, foot - eye, np.zeros((40, 2)))


def rising(kind: str, place: Place, angle: float) -> list[Json]:
    """A wall six units wide that rises at an angle from a line of eight units."""
    corner, along = place.at(0, 0, -4), place.way(0, 0, 8)
    up = place.way(6 * math.cos(angle), 6 * math.sin(angle), 0)
    if kind == "tiles":
        return [rectangle(corner, along, up)]
    steps = np.linspace(0, 1, SHARES[kind] + 1)
    u, v = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
    _, faces = grid(place, steps, 0.0)
    return triangulated(kind, corner + np.outer(u, along) + np.outer(v, up), faces)


CASES: Cases = {
    "E1: a plane in its own shadow": lambda: asked(_bare(0.0, offsets=OFFSETS)),
    "E1: a ball in its own shadow": own_ball,
    "E3: a scene in other units": lambda: asked(_bare(STEP, offsets=(0.0, 1e3), scales=SCALES)),
    "E3: shadows in units of a power of two": powers_of_two,
    "E2: an occluder just above the floor": detached,
    "E10: the corners of a room": corners,
    "E14: walls at a sharp angle": sharp_corners,
}
