"""Each remedy switched off by itself, and the hard case that fails without it.

What takes a remedy's place is the textbook's formula, or the same code without its guard. A case that still
holds does not need the remedy: then one of the two goes.
"""

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from accuracy.hard_cases import Case, formulas, sections
from accuracy.hard_cases.cameras import plain_disk
from accuracy.hard_cases.harness import each_of
from accuracy.hard_cases.textures.normal_maps import plain_tangents
from accuracy.hard_cases.trees_and_bounces.bounces import GLASS
from renderer.samplers import PATTERNS
from renderer.textures.image import WRAPS
from tests.numerics import without_remedies as without

Patches = Mapping[str, Any]
"""Dotted names, and what stands in their place."""

CASES = {(case.ids[0], case.name): case for section in sections() for case in section.cases}

OUTPUT = "accuracy.hard_cases.samples_and_output.output.displayed"
TRIANGLES = {"renderer.shapes.woop.hits": without.hits_by(0.0)}
LIMITED = {"renderer.shapes.woop.hits": without.hits_by(formulas.SMALL)}
PROJECTED = {"renderer.shapes.rectangles.Rectangles.meet": without.projected(0.0)}
PROJECTED_WITH_LIMIT = {"renderer.shapes.rectangles.Rectangles.meet": without.projected(formulas.SMALL)}
QUADRATIC = {"renderer.shapes.ellipsoids.Ellipsoids.meet": without.quadratic(np.float64)}
IN_SINGLE = {"renderer.shapes.ellipsoids.Ellipsoids.meet": without.quadratic(np.float32)}
UNWRAPPED = {"renderer.textures.image.WRAPS": dict.fromkeys(WRAPS, lambda index, _: index)}
NO_SIDES = {
    "renderer.visibility.polygons.settled": without.trusted,
    "renderer.visibility.sides.settled": without.trusted,
}

SWITCHED_OFF: dict[tuple[str, str], Patches] = {
    ("A1", "up along the view"): {"renderer.cameras.pinhole.parallel": lambda *_: False},
    ("A1", "length of up"): {"renderer.cameras.pinhole.unit": without.plain_unit},
    ("A2", "view nearly along up"): {"renderer.cameras.pinhole.basis": without.once_perpendicular},
    ("A3", "a camera that looks at where it stands"): {"renderer.cameras.pinhole.unit": without.plain_unit},
    ("A4", "field of view at its ends"): {"renderer.cameras.pinhole.Pinhole.directions": without.in_single},
    ("A5", "a camera far from the origin"): {
        "renderer.cameras.pinhole.Pinhole.directions": without.between_places
    },
    ("A6", "pictures of one row, one column, one pixel"): {
        "renderer.cameras.pinhole.Pinhole.screen": without.plain_screen
    },
    ("A8", "a lens far from the origin"): {
        "renderer.cameras.pinhole.Pinhole.directions": without.between_places
    },
    ("A9", "the middle of the lens"): {
        "accuracy.hard_cases.cameras.disk": lambda a, b: plain_disk(2 * a - 1, 2 * b - 1)
    },
    ("B2", "slivers"): LIMITED,
    ("B3", "needles"): LIMITED,
    ("B4", "tiny triangles"): LIMITED,
    ("B4", "one scene in many units"): LIMITED,
    ("B5", "huge triangles"): {"renderer.shapes.woop.hits": without.hits_in_single},
    ("B6", "rays at a shared edge"): TRIANGLES,
    ("B7", "rays at a shared vertex"): TRIANGLES,
    ("B11", "triangles at a grazing angle"): LIMITED,
    ("B12", "points far from the camera"): {
        "renderer.shapes.triangles.Triangles.locate": without.along_the_ray
    },
    ("B13", "rays that start on a triangle"): {"renderer.shapes.woop._rounding": lambda *_: np.zeros(1)},
    ("B14", "hits close to what their error allows"): {"renderer.shapes.woop.gamma": without.wide},
    ("B15", "triangles far from the origin"): {"renderer.shapes.woop.hits": without.hits_in_single},
    ("C1", "edges that are not perpendicular"): PROJECTED,
    ("C2", "corners of a room"): PROJECTED,
    ("C3", "rectangles at a grazing angle"): PROJECTED_WITH_LIMIT,
    ("C6", "rays exactly through edges and corners"): PROJECTED,
    ("C7", "long and narrow rectangles"): PROJECTED,
    ("C8", "rectangles of any size"): {
        "renderer.shapes.rectangles.Rectangles.meet": without.projected(formulas.SMALL)
    },
    ("C9", "edges that agree but for rounding"): {"renderer.shapes.rectangles.gamma": lambda _: 0.0},
    ("C10", "rays that start on a rectangle"): {"renderer.shapes.rectangles.gamma": lambda _: 0.0},
    ("D1", "tiny spheres far away"): QUADRATIC,
    ("D2", "a giant sphere as the ground"): IN_SINGLE,
    ("D3", "starts close to the surface"): IN_SINGLE,
    ("D4", "axes a million to one"): QUADRATIC,
    ("D5", "centres far from the origin"): QUADRATIC,
    ("D6", "starts inside"): IN_SINGLE,
    ("D7", "exactly tangent rays"): QUADRATIC,
    ("D8", "nearly tangent rays"): IN_SINGLE,
    ("D8", "outlines in both precisions"): IN_SINGLE,
    ("D9", "starts on the surface"): QUADRATIC,
    ("D10", "ellipsoids behind the start"): IN_SINGLE,
    ("D11", "directions of any length"): QUADRATIC,
    ("D13", "normals of flat ellipsoids"): {
        "renderer.shapes.ellipsoids.Ellipsoids.locate": without.normals_by_the_axes
    },
    ("D15", "texture coordinates at the poles"): {
        "renderer.shapes.ellipsoids._angles": without.by_arc_cosine
    },
    ("E8", "a place under a seam"): {
        "renderer.visibility.polygon_grids.outward": lambda values, dtype: values.astype(dtype),
        "renderer.visibility.polygons.SURFACE": 0.0,
    },
    ("E14", "walls at a sharp angle"): NO_SIDES,
    ("E15", "the seams of a flat floor"): NO_SIDES,
    ("F1", "exponent 0"): {"renderer.materials.phong._powers": without.plain_powers},
    ("F2", "powers of negative cosines"): {
        "renderer.materials.phong._powers": without.powers_of_any_sign,
        "renderer.lights.view.LightView.cosines": without.cosines_of_any_sign,
    },
    ("F3", "very sharp highlights"): {"renderer.plan.lights.SHARP": 1e30},
    ("F5", "shading normals that face away"): {"renderer.materials.horizon._at_horizon": without.left_black},
    ("F7", "straight into the mirrored light"): {"renderer.materials.phong._powers": without.plain_powers},
    ("G1", "the borders of an image"): UNWRAPPED,
    ("G2", "tiny negative coordinates"): UNWRAPPED,
    ("G3", "huge coordinates"): {"renderer.textures.image.ImageTexture._texel": without.without_reduction},
    ("G4", "constant images"): {"renderer.textures.image.ImageTexture._bilinear": without.four_weights},
    ("G5", "the poles of a ball"): {"renderer.shapes.ellipsoids._angles": without.by_arc_cosine},
    ("G6", "fields smaller than pixels"): {
        "renderer.textures.footprints.Footprints.run": without.no_footprints
    },
    ("G7", "normal-map texels that say nothing"): {"renderer.materials.maps.FLAT": 0.0},
    ("G8", "frames near the lower pole"): {
        "accuracy.hard_cases.textures.normal_maps.frame_of_normals": plain_tangents
    },
    ("G8", "tangents that say nothing"): {
        "renderer.materials.maps.SHORT": -1.0,
        "renderer.shapes.frames.SHORT": -1.0,
    },
    ("G9", "edges of displaced faces"): {"renderer.shapes.displacement._lift": without.unwelded},
    ("G10", "flat height maps"): {"renderer.shapes.displacement._turned": lambda _, moved: moved},
    ("G12", "edges of displaced neighbours"): {"renderer.shapes.displacement.join": lambda _: None},
    ("H2", "rays at the edges of boxes"): {
        "renderer.accelerators.bvh.WIDENING": 0.0,
        "renderer.accelerators.bvh.gamma": lambda _: 0.0,
    },
    ("H4", "rays that are not finite"): {
        "renderer.tracing.finite": lambda values: np.ones(values.shape[1], dtype=bool)
    },
    ("H6", "the critical angle"): {
        "renderer.materials.optics.transmitted_cosine": without.plain_transmitted_cosine
    },
    ("H8", "a ray that leaves glass"): {
        "renderer.shapes.ellipsoids.Ellipsoids._departed": without.free_to_leave,
        # Rays that never get out would double with each bounce.
        "accuracy.hard_cases.trees_and_bounces.bounces.GLASS": {**GLASS, "max_depth": 4},
    },
    ("H9", "glass of index 1"): {
        "renderer.materials.optics.transmitted_cosine": without.plain_transmitted_cosine
    },
    ("H10", "faces that overlap in one plane"): {
        "renderer.accelerators.bvh.AHEAD": 1.0,
        "renderer.accelerators.meeting.AHEAD": 1.0,
    },
    ("H11", "shapes that overlap in one plane"): {
        "renderer.plan.overlaps.overlapping": lambda *_: (np.zeros(0, dtype=np.int64),) * 2
    },
    ("I1", "a turned grid that leaves the pixel"): {
        "accuracy.hard_cases.samples_and_output.samples.PATTERNS": {
            **PATTERNS,
            "rotated": without.not_wrapped,
        }
    },
    ("H13", "corners of facing mirrors"): {"renderer.self_intersection.NEAR": 0.0},
    ("I2", "an edge through a pixel"): {
        "renderer.integrator.PATTERNS": {**PATTERNS, "rotated": without.shrunk}
    },
    ("I3", "random numbers and tiles"): {"renderer.samplers.patterns.bits": without.in_turn(1)},
    ("I4", "a million samples"): {
        "accuracy.hard_cases.samples_and_output.samples.halving_sum": without.summed_in_order
    },
    ("I5", "samples that are nearly equal"): {"renderer.layers.spread.Spread.add": without.plain_spread},
    ("I6", "numbers that are no brightness"): {OUTPUT: without.shown(clipped=False, rounded=True)},
    ("I7", "all codes there and back"): {OUTPUT: without.shown(clipped=True, rounded=False)},
    ("I8", "the toe of the curve"): {OUTPUT: without.shown(clipped=False, rounded=True)},
    ("I9", "very bright and quite black"): {"renderer.film.BRIGHTEST": np.inf},
    ("I10", "random numbers just below 1"): {
        "accuracy.hard_cases.samples_and_output.samples.uniforms": lambda drawn: drawn * 2.0**-32
    },
    ("J3", "very small numbers"): {"accuracy.hard_cases.scene_values.values.unit": without.plain_unit},
    ("J11", "fused products in edge functions"): {"renderer.shapes.woop._sheared": without.fused_sheared},
}


def fails(case: Case) -> bool:
    """Whether a case has a wrong answer, or breaks off; what comes after the first need not be tried."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return any(outcome.wrong for outcome in each_of(case.outcomes()))
        except (ArithmeticError, IndexError, ValueError):
            return True


@pytest.mark.parametrize("named", SWITCHED_OFF, ids=" ".join)
def test_a_case_fails_without_its_remedy(named: tuple[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    for name, instead in SWITCHED_OFF[named].items():
        monkeypatch.setattr(name, instead)
    assert fails(CASES[named])
