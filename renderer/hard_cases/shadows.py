"""Hard cases: shadows and light."""

import itertools
from collections.abc import Callable, Iterator

import numpy as np

import renderer
from renderer.hard_cases.cases import Outcome, Section, total
from renderer.hard_cases.documents import (
    bulb,
    camera,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    triangle,
)
from renderer.hard_cases.plain_shadows import STEP, light_hides_itself, self_shadowed, stepped_over
from renderer.hard_cases.shadow_rooms import WALLS, inner_lights, outer_lights, room, seen_in_room
from renderer.hard_cases.shadow_scenes import (
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
    places,
)

SECTION = Section("Shadows and light")


def _asked(views: Iterator[tuple[View, int, int]]) -> Outcome:
    """Ask about views in both precisions and all patterns in turn; what the textbook gets wrong is given."""
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
    return _asked(_bare(lambda _: 0.0, offsets=OFFSETS))


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
    return _asked(_bare(lambda _: STEP, offsets=(0.0, 1e3), scales=SCALES))


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

    return _asked(views())


@SECTION.case(
    "the light's own surface",
    symptom="A lamp lights with a fine grain, as if it were full of holes.",
    cause="A light point is rounded off the lamp's plane, and the shadow ray meets the lamp before its end.",
    remedy="Lights cast no shadow, and a shape in the light's own plane is not between.",
    expected="A lamp set into a ceiling of the same plane is seen whole from 1,000 places.",
    source="geometry",
)
def own_surface() -> Outcome:
    """A lamp in its ceiling."""
    chosen = np.random.default_rng(3)
    outcomes = []
    for precision, pattern in itertools.product(PRECISIONS, PATTERNS):
        first, second = np.linalg.qr(chosen.normal(size=(3, 2)))[0].T
        corner, down = chosen.normal(size=3), np.cross(first, second)
        ceiling = rectangle(
            *((corner - first - second).tolist(), (3 * first).tolist(), (3 * second).tolist())
        )
        floor_ = rectangle(
            (corner - 4 * down - 5 * (first + second)).tolist(), (10 * first).tolist(), (10 * second).tolist()
        )
        light = lamp(corner.tolist(), first.tolist(), second.tolist())
        document = scene(ceiling, floor_, lights=[light], sampling=sampled(1, 16, light=pattern))
        targets = corner - 4 * down + chosen.uniform(-4, 4, (125, 2)) @ np.stack((first, second))
        origin = corner - 2 * down
        hits = renderer.trace(
            renderer.compile_scene(renderer.load_scene(document), precision),
            np.broadcast_to(origin, targets.shape),
            targets - origin,
        )
        double, single = (
            int(np.count_nonzero(light_hides_itself(targets[0], corner, first, second, dtype)))
            for dtype in (np.float64, np.float32)
        )
        wrong = int(np.count_nonzero((hits.visibility[:, 0] != 1) | (hits.shape != 1)))
        outcomes.append(Outcome(len(targets), wrong, double, single))
    return total(outcomes)


@SECTION.case(
    "the corners of a room",
    symptom="Light from outside shines in along the lines where walls meet; mirrors there show black dots.",
    cause="Each wall rounds its own edge, and a gap of one rounding is left between two.",
    remedy="Edge functions of neighbours differ in sign alone, and edges are moved out by their rounding.",
    expected="At the corner lines, lights outside are never seen, and lights inside always are.",
    source="Woop, Benthin and Wald 2013; geometry",
)
def corners() -> Outcome:
    """Rooms of three kinds of walls, with and without a mirror."""
    outcomes = []
    for number, (kind, mirrors) in enumerate(itertools.product(WALLS, ((), (0,)))):
        for chosen, place in places(f"corners {kind}", offsets=(0.0, 1e7)):
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
    return total(outcomes)


@SECTION.case(
    "a light in the plane of the receiver",
    symptom="A surface beside a lamp that lies in its plane is speckled with light.",
    cause="The cosine is a rounding above or below 0, and its sign decides.",
    remedy="Light within rounding of the horizon gives nothing.",
    expected="Exactly black, in both precisions.",
    source="geometry",
)
def coplanar() -> Outcome:
    """A floor and a lamp turned alike."""
    chosen = np.random.default_rng(9)
    outcomes = []
    for precision in PRECISIONS * 8:
        first, second = np.linalg.qr(chosen.normal(size=(3, 2)))[0].T
        up, corner = np.cross(first, second), chosen.normal(size=3)
        document = scene(
            rectangle(corner.tolist(), first.tolist(), second.tolist()),
            sphere((corner + 9 * up).tolist(), 0.5),
            lights=[lamp((corner + 2 * first).tolist(), first.tolist(), second.tolist(), visible=False)],
            ambient=[0, 0, 0],
            background=[0, 0, 0],
            materials={"plain": phong([1, 1, 1], ambient=0, diffuse=1)},
            camera=camera(position=(corner + 2 * up).tolist(), look_at=corner.tolist(), up=first.tolist()),
            sampling=sampled(1, 16),
        )
        image = renderer.render(renderer.compile_scene(renderer.load_scene(document), precision)).image
        points = corner + chosen.uniform(0, 1, (384, 2)) @ np.stack((first, second))
        towards = corner + 2.5 * first + 0.5 * second - points
        plain, coarse = (
            int(np.count_nonzero(towards.astype(dtype) @ up.astype(dtype) > 0))
            for dtype in (np.float64, np.float32)
        )
        outcomes.append(Outcome(384, int(np.count_nonzero(image.any(axis=2))), plain, coarse))
    return total(outcomes)


@SECTION.case(
    "a light inside an object",
    symptom="A lamp in a closed ball lights the room.",
    cause="Only the first of two hits is looked at, or the far one is taken to be behind.",
    remedy="Both hits of an ellipsoid count, and those between the ends block.",
    expected="Exactly the ambient term everywhere outside.",
    source="geometry",
)
def inside() -> Outcome:
    """A bulb and a lamp in a ball over a floor; the textbook takes the near hit alone."""
    outcomes = []
    for precision in PRECISIONS:
        document = scene(
            rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
            sphere([0, 2, 0], 1.0),
            lights=[bulb([0, 2, 0]), lamp([-0.2, 2, -0.2], [0.4, 0, 0], [0, 0, 0.4], visible=False)],
            sampling=sampled(1, 16),
        )
        chosen = np.random.default_rng(1)
        targets = np.insert(chosen.uniform(-4, 4, (1000, 2)), 1, 0.0, axis=1)
        origins = targets + np.array([0.0, 0.5, 0])
        hits = renderer.trace(
            renderer.compile_scene(renderer.load_scene(document), precision), origins, targets - origins
        )
        # From the light to the floor, the near hit is behind the light.
        towards = targets - np.array([0.0, 2, 0])
        near = -1 / np.sqrt((towards * towards).sum(axis=1))
        plain = int(np.count_nonzero(near < 0))
        on_floor = hits.shape == 0
        wrong = int(np.count_nonzero(hits.visibility[on_floor]))
        outcomes.append(Outcome(int(np.count_nonzero(on_floor)), wrong, plain, plain))
    return total(outcomes)


@SECTION.case(
    "what is beyond the light or behind the receiver",
    symptom="Things that are not in between cast shadows.",
    cause="The hit on the line is taken without its place on it, or with a bound that is too wide.",
    remedy="Both ends of the segment have to be on different sides of the occluder's plane.",
    expected="The light is seen whole, with the occluder a thousandth of the way beyond or behind.",
    source="geometry",
)
def beyond() -> Outcome:
    """Rectangles and triangles on the line of a bulb, and a textbook without an end."""
    outcomes = []
    receiver = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0])
    for precision, height in itertools.product(PRECISIONS, (4.004, -0.004)):
        for other in (
            rectangle([-3, -3, height], [6, 0, 0], [0, 6, 0]),
            triangle([-9, -9, height], [9, -9, height], [0, 9, height]),
        ):
            document = scene(receiver, other, lights=[bulb([0, 0, 4])])
            targets = np.insert(np.random.default_rng(2).uniform(-1, 1, (250, 2)), 2, 0.0, axis=1)
            origins = targets * [0.5, 0.5, 0] + np.array([0.0, 0, 1])
            hits = renderer.trace(
                renderer.compile_scene(renderer.load_scene(document), precision), origins, targets - origins
            )
            wrong = int(np.count_nonzero((hits.visibility[:, 0] != 1) | (hits.shape != 0)))
            outcomes.append(Outcome(250, wrong, 250, 250))
    return total(outcomes)
