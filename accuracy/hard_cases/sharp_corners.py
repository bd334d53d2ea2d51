"""Hard cases: lines where walls meet at sharp angles."""

import itertools
import math
from collections.abc import Iterator

import numpy as np

from accuracy.hard_cases.cases import Outcome, Section
from accuracy.hard_cases.documents import Json, bulb, lamp, rectangle
from accuracy.hard_cases.occluders import asked
from accuracy.hard_cases.plain_shadows import STEP, in_the_way
from accuracy.hard_cases.shadow_rooms import SHARES, WALLS
from accuracy.hard_cases.shadow_scenes import Place, View, grid, places, triangulated

SECTION = Section("Sharp corners")

ANGLES = (90.0, 50.0, 20.0, 1.0)
"""Between the outer two of three walls, degrees."""


@SECTION.case(
    "walls at a sharp angle",
    symptom="Bright dots from a light outside, along the line where the walls of a tent or a wedge meet.",
    cause="A place on that line is a rounding in front of a wall. The way to a light goes through the wall "
    "farther along, the flatter it is the farther, and there the wall has ended.",
    remedy="A place that touches a plane counts as in front of it, yet next to nothing away.",
    expected="From the foot of a wall between two others no light behind these is seen, at angles down to "
    "1 degree.",
    source="geometry",
)
def sharp_corners() -> Outcome:
    """A bulb and a lamp, seen flat by both walls; the textbook steps over what is near."""

    def views() -> Iterator[tuple[View, int, int]]:
        for kind, degrees in itertools.product(WALLS, ANGLES):
            for chosen, place in places(f"sharp {kind} {degrees}", offsets=(0.0, 1e3, 1e7)):
                view = _wedge(kind, math.radians(degrees), place, chosen)
                foot = view.origins + view.directions
                ways = np.array(view.lights[0]["position"]) - foot
                double, single = (
                    2 * int(np.count_nonzero(~in_the_way(view.shapes, foot, ways, dtype, STEP)))
                    for dtype in (np.float64, np.float32)
                )
                yield view, double, single

    return asked(views())


def _wedge(kind: str, angle: float, place: Place, chosen: np.random.Generator) -> View:
    """Rays from between the outer walls at the foot of the one between them, with lights behind."""
    walls = [wall for share in (0, 1, 0.45) for wall in rising(kind, place, share * angle)]
    away, within = math.pi + angle / 2, angle * chosen.choice([0.2, 0.8])
    behind = place.at(5 * math.cos(away), 5 * math.sin(away), 0.3).tolist()
    edges = place.way(0, 0, 0.8), place.way(-0.3 * math.sin(away), 0.3 * math.cos(away), 0)
    lights = [bulb(behind), lamp(behind, *(edge.tolist() for edge in edges), two_sided=True)]
    foot = place.at(10.0 ** chosen.uniform(-17, -14, 40), 0, chosen.uniform(-3, 3, 40))
    eye = np.tile(place.at(2.5 * math.cos(within), 2.5 * math.sin(within), 0.2), (40, 1))
    return View(walls, lights, len(walls), eye, foot - eye, np.zeros((40, 2)))


def rising(kind: str, place: Place, angle: float) -> list[Json]:
    """A wall six units wide that rises at an angle from a line of eight units."""
    corner, along = place.at(0, 0, -4), place.way(0, 0, 8)
    up = place.way(6 * math.cos(angle), 6 * math.sin(angle), 0)
    if kind == "tiles":
        return [rectangle(corner.tolist(), along.tolist(), up.tolist())]
    steps = np.linspace(0, 1, SHARES[kind] + 1)
    u, v = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
    _, faces = grid(place, steps, 0.0)
    return triangulated(kind, corner + np.outer(u, along) + np.outer(v, up), faces)
