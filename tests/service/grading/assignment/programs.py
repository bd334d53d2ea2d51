"""Whole wrong programs: 24 classic mistakes, each made in every picture and ray table at once.

`mistakes` puts a mistake into the files that it is about. A student's program makes it everywhere, so that
one mistake may cost points in many tests, and under several names.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

Verdict = Literal["right", "wrong", "none"]

LEAST_RIGHT = 22
"""Goal: so many of the programs are named right,"""

MOST_WRONG = 0
"""and so many named wrong; the others are given no cause."""


@dataclass(frozen=True)
class Program:
    """A program with one mistake.

    Attributes
    ----------
    name : str
        The switch in `Tracer`.
    words : str
        What the program does.
    causes : tuple of str
        Causes that name the mistake.
    says : tuple of str
        Words of a message without a cause, such as those about rays, that name it.
    """

    name: str
    words: str
    causes: tuple[str, ...]
    says: tuple[str, ...] = ()

    def verdict(self, lost: Iterable[Mapping[str, Any]]) -> Verdict:
        """Whether the tests that lost points name the mistake: one wrong name outweighs all the right ones.

        Parameters
        ----------
        lost
            With the keys `test`, `cause` (None if the grader found none) and `message`.
        """
        found = {self._named(part) for part in lost}
        return "wrong" if "wrong" in found else "right" if "right" in found else "none"

    def _named(self, part: Mapping[str, Any]) -> Verdict:
        if part["cause"]:
            return "right" if part["cause"] in self.causes else "wrong"
        if any(words in part["message"] for words in self.says):
            return "right"
        # What is left of a message about rays is advice. Others say where pictures differ, not why.
        return "wrong" if part["message"] and part["test"].startswith("rays-") else "none"


PROGRAMS = (
    Program("half_pixel_off", "samples lie around the pixel's corner", ("half_pixel_right_down",)),
    Program(
        "corner_sampling",
        "one sample at the pixel's corner",
        ("half_pixel_right_down", "antialiasing_missing"),
    ),
    Program("bgr", "channels are stored as blue, green, red", ("channels_bgr",)),
    Program("brighter", "the exposure is 1.1 times too large", ("exposure",)),
    Program("no_ambient", "no ambient term", ("ambient_missing",)),
    Program("upside_down", "rows are counted from below", ("flipped_vertically",)),
    Program("gamma_missing", "numbers are saved as they are, linear", ("gamma_missing",)),
    Program("hard_shadow", "the lamp is one point", ("hard_shadows",)),
    Program("one_sample", "one sample in the middle of a pixel", ("antialiasing_missing",)),
    Program("same_places", "16 samples in the middle of a pixel", ("antialiasing_missing",)),
    Program("shininess_doubled", "twice the shininess", ("shininess",)),
    Program(
        "normal_flipped",
        "normals point away from the viewer",
        ("normals_flipped",),
        ("Normals point the wrong way",),
    ),
    Program("acne", "shadow rays hit the surface they start at", ("shadow_acne",)),
    Program("axes_not_unit", "forward x up is not normalised", ("camera_axes_not_unit",)),
    Program("axes_not_orthogonal", "up itself is the third axis", ("camera_axes_not_orthogonal",)),
    Program("specular_unclamped", "r . v in place of max(0, r . v)", ("highlight_not_clamped",)),
    Program("size_minus_one", "pixels are divided by width - 1", ("size_minus_one",)),
    Program("same_light_points", "all pixels see the same 16 points of the lamp", ("light_points_shared",)),
    Program(
        "last_shape_wins",
        "the last shape hit is drawn, not the nearest",
        ("last_hit_drawn",),
        ("take the nearest",),
    ),
    Program("size_swapped", "width and height are swapped", (), ("width and height are swapped",)),
    Program("fov_not_halved", "tan(fov) for tan(fov / 2)", ("field_of_view",)),
    Program("no_shadows", "no shadow rays", ("shadows_missing",)),
    Program(
        "normal_like_points",
        "ellipsoids have the normals of spheres",
        ("normals_of_spheres",),
        ("normals of spheres",),
    ),
    Program("texture_upside_down", "row 0 is v = 0", ("texture_upside_down",)),
)


def reached(verdicts: Iterable[str]) -> str:
    """A line that says how far the verdicts are from the goal."""
    counts = Counter(verdicts)
    right, wrong = counts["right"], counts["wrong"]
    met = right >= LEAST_RIGHT and wrong <= MOST_WRONG
    return (
        f"named right: {right} of {counts.total()} (goal: at least {LEAST_RIGHT}); "
        f"named wrong: {wrong} (goal: {MOST_WRONG}); the goal is {'met' if met else 'missed'}"
    )
