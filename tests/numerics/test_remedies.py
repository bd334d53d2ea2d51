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
from renderer.lights.emitters import Emitter
from renderer.samplers import PATTERNS
from renderer.textures.image import WRAPS
from tests.numerics import light_without_remedies as light
from tests.numerics import shapes_without_remedies as shapes

Patches = Mapping[str, Any]
"""Dotted names, and what stands in their place."""

CASES = {case.heading: case for section in sections() for case in section.cases}

OUTPUT = "accuracy.hard_cases.samples_and_output.output.displayed"
TRIANGLES = {"renderer.shapes.woop.hits": shapes.hits_by(0.0)}
LIMITED = {"renderer.shapes.woop.hits": shapes.hits_by(formulas.SMALL)}
PROJECTED = {"renderer.shapes.rectangles.Rectangles.intersect": shapes.projected(0.0)}
PROJECTED_WITH_LIMIT = {"renderer.shapes.rectangles.Rectangles.intersect": shapes.projected(formulas.SMALL)}
QUADRATIC = {"renderer.shapes.ellipsoids.Ellipsoids.intersect": shapes.quadratic(np.float64)}
IN_SINGLE = {"renderer.shapes.ellipsoids.Ellipsoids.intersect": shapes.quadratic(np.float32)}
UNWRAPPED = {"renderer.textures.image.WRAPS": dict.fromkeys(WRAPS, lambda index, _: index)}
NO_SIDES = {
    "renderer.visibility.polygons.settled": light.trusted,
    "renderer.visibility.sides.settled": light.trusted,
}

AS_COMPUTED = {
    "renderer.visibility.polygons.settled": light.as_computed,
    "renderer.visibility.sides.settled": light.as_computed,
}
STEPPED = {
    "renderer.visibility.polygons.settled": light.stepped_over,
    "renderer.visibility.sides.settled": light.stepped_over,
}
WITHOUT_AREA = {
    "renderer.plan.geometry.no_area": lambda _: False,
    "renderer.shapes.meshes._without_area": lambda _, __, thin: np.zeros_like(thin),
}
FUSED = {"renderer.shapes.woop._sheared": shapes.fused_sheared}
UNCHECKED = {"accuracy.hard_cases.harness.read_scene": shapes.unchecked}

SWITCHED_OFF: dict[str, Patches] = {
    "A1: up along the view": {"renderer.cameras.parallel": lambda *_: False},
    "A2: view nearly along up": {"renderer.cameras.basis": shapes.once_perpendicular},
    "A1: length of up": {"renderer.cameras.unit": shapes.plain_unit},
    "A3: a camera that looks at where it stands": {"renderer.cameras.unit": shapes.plain_unit},
    "A4: field of view at its ends": {"renderer.cameras.Pinhole.directions": shapes.in_single},
    "A5: a camera far from the origin": {"renderer.cameras.Pinhole.directions": shapes.between_places},
    "A6: pictures of one row, one column, one pixel": {
        "renderer.cameras.Pinhole.screen": shapes.plain_screen
    },
    "A7: focal length": {"renderer.plan.building.build_pinhole": shapes.at_the_focal_length},
    "A8: a lens far from the origin": {"renderer.cameras.Pinhole.directions": shapes.between_places},
    "A9: the middle of the lens": {
        "accuracy.hard_cases.cameras.disk": lambda a, b: plain_disk(2 * a - 1, 2 * b - 1)
    },
    "B1: triangles without area": WITHOUT_AREA,
    "B2: slivers": LIMITED,
    "B3: needles": LIMITED,
    "B4: tiny triangles": LIMITED,
    "B4: one scene in many units": LIMITED,
    "B5: huge triangles": {"renderer.shapes.woop.hits": shapes.hits_in_single},
    "B15: triangles far from the origin": {"renderer.shapes.woop.hits": shapes.hits_in_single},
    "B6: rays at a shared edge": TRIANGLES,
    "B6: rays exactly at a shared edge": FUSED,
    "B7: rays at a shared vertex": TRIANGLES,
    "B8: a closed mesh, near and far": TRIANGLES,
    "B8: a closed surface of single triangles, near and far": TRIANGLES,
    "B9, B10: rays along a triangle's plane": {
        "renderer.shapes.woop.hits": shapes.hits_or_nan,
        "renderer.interaction.Rays.offer": shapes.taken_unless_farther,
    },
    "B11: triangles at a grazing angle": LIMITED,
    "B12: points far from the camera": {"renderer.shapes.triangles.Triangles.locate": shapes.along_the_ray},
    "B14: hits close to what their error allows": {"renderer.shapes.woop.gamma": shapes.wide},
    "B13: rays that start on a triangle": {"renderer.shapes.woop._rounding": lambda *_: np.zeros(1)},
    "C1: edges that are not perpendicular": PROJECTED,
    "C2: corners of a room": PROJECTED,
    "C9: edges that agree but for rounding": {"renderer.shapes.rectangles.gamma": lambda _: 0.0},
    "C3: rectangles at a grazing angle": PROJECTED_WITH_LIMIT,
    "C4: rays along a rectangle's plane": {
        "renderer.shapes.rectangles.Rectangles.intersect": shapes.projected_or_nan,
        "renderer.interaction.Rays.offer": shapes.taken_unless_farther,
    },
    "C5: rectangles without area": UNCHECKED,
    "C6: rays exactly through edges and corners": PROJECTED,
    "C7: long and narrow rectangles": PROJECTED,
    "C8: rectangles of any size": {
        "renderer.shapes.rectangles.Rectangles.intersect": shapes.projected(formulas.SMALL)
    },
    "C10: rays that start on a rectangle": {"renderer.shapes.rectangles.gamma": lambda _: 0.0},
    "D1: tiny spheres far away": QUADRATIC,
    "D2: a giant sphere as the ground": IN_SINGLE,
    "D3: starts close to the surface": IN_SINGLE,
    "D4: axes a million to one": QUADRATIC,
    "D5: centres far from the origin": QUADRATIC,
    "D6: starts inside": IN_SINGLE,
    "D8: nearly tangent rays": IN_SINGLE,
    "D10: ellipsoids behind the start": IN_SINGLE,
    "D11: directions of any length": QUADRATIC,
    "D12: zero and negative zero components": {
        "renderer.shapes.ellipsoids.Ellipsoids.intersect": shapes.roots_by(formulas.boxed_quadratic)
    },
    "D7: exactly tangent rays": QUADRATIC,
    "D9: starts on the surface": QUADRATIC,
    "D13: normals of flat ellipsoids": {
        "renderer.shapes.ellipsoids.Ellipsoids.locate": shapes.normals_by_the_axes
    },
    "D15: texture coordinates at the poles": {"renderer.shapes.ellipsoids._angles": shapes.by_arc_cosine},
    "D8: outlines in both precisions": IN_SINGLE,
    "D14: semi-axes that make no ellipsoid": UNCHECKED,
    "E1: a plane in its own shadow": AS_COMPUTED,
    "E1: a ball in its own shadow": {
        "renderer.visibility.ellipsoids.EllipsoidShadows.run": light.balls_shade_themselves,
        "renderer.visibility.ellipsoids.EllipsoidShadows._rounding": light.no_rounding,
    },
    "E3: a scene in other units": {"renderer.lights.view._reaches": light.reached_by_a_length},
    "E3: shadows in units of a power of two": STEPPED,
    "E2: an occluder just above the floor": STEPPED,
    "E10: the corners of a room": NO_SIDES,
    "E14: walls at a sharp angle": NO_SIDES,
    "E15: the seams of a flat floor": NO_SIDES,
    "E8: a place under a seam": {
        "renderer.visibility.polygon_grids.outward": lambda values, dtype: values.astype(dtype),
        "renderer.visibility.polygons.SURFACE": 0.0,
    },
    "E16: a sliver in the light": AS_COMPUTED,
    "E17: a rough relief": AS_COMPUTED,
    "E4: the light's own surface": AS_COMPUTED,
    "E6: a light in the plane of the receiver": {"renderer.lights.view._reaches": light.reached_by_sign},
    "E9: a light inside an object": {
        "renderer.visibility.ellipsoids.EllipsoidShadows._inner_light_points": lambda *_: None,
    },
    "E11: what is beyond the light or behind the receiver": {
        "renderer.lights.emitters.Emitter.ends": light.past_the_light(Emitter.ends),
        "renderer.lights.emitters.Emitter.shared_points": light.past_the_light(Emitter.shared_points),
    },
    "E5: a light that touches its receiver": {
        "renderer.lights.view.LightView.scale": lambda view: np.ones(view.count)
    },
    "E7: a light below the horizon": {
        "renderer.plan.stages.facing": lambda _, points, __: np.ones(points.count, dtype=bool)
    },
    "E12: the terminator of a coarse mesh": {
        "renderer.lights.view.LightView.block_below_horizon": lambda _: None
    },
    "E13: a light that is half covered": {"renderer.lights.emitters.Emitter.grid": light.corners_of_cells},
    "F1: exponent 0": {"renderer.materials.phong._powers": light.plain_powers},
    "F2: powers of negative cosines": {
        "renderer.materials.phong._powers": light.powers_of_any_sign,
        "renderer.lights.view.LightView.cosines": light.cosines_of_any_sign,
    },
    "F3: very sharp highlights": {"renderer.plan.lights.SHARP": 1e30},
    "F7: straight into the mirrored light": {"renderer.materials.phong._powers": light.plain_powers},
    "F4: mirrors at a grazing angle": {"accuracy.hard_cases.phong.reflected": light.reflected_in_single},
    "F6: seen from behind": {"renderer.shapes.triangles.Triangles.locate": shapes.not_turned},
    "F5: shading normals that face away": {"renderer.materials.maps._at_horizon": light.left_black},
    "F8: normals straight away from the viewer": {
        "renderer.materials.maps._at_horizon": light.across_the_view
    },
    "G1: the borders of an image": UNWRAPPED,
    "G2: tiny negative coordinates": UNWRAPPED,
    "G3: huge coordinates": {"renderer.textures.image.ImageTexture._texel": light.without_reduction},
    "G4: constant images": {"renderer.textures.image.ImageTexture._bilinear": light.four_weights},
    "G5: the poles of a ball": {"renderer.shapes.ellipsoids._angles": shapes.by_arc_cosine},
    "G5: texture coordinates that are no numbers": WITHOUT_AREA,
    "G6: fields smaller than pixels": {"renderer.textures.footprints.Footprints.run": light.no_footprints},
    "G7: normal-map texels that say nothing": {"renderer.materials.maps.FLAT": 0.0},
    "G11: a flat normal map on a smooth mesh": {"renderer.materials.maps.FLAT": -1.0},
    "G8: frames near the lower pole": {
        "accuracy.hard_cases.textures.normal_maps.frame_of_normals": plain_tangents
    },
    "G8: tangents that say nothing": {
        "renderer.materials.maps.SHORT": -1.0,
        "renderer.shapes.frames.SHORT": -1.0,
    },
    "G9: edges of displaced faces": {"renderer.shapes.displacement._lift": light.unwelded},
    "G10: flat height maps": {"renderer.shapes.displacement._turned": lambda _, moved: moved},
    "G10: the shadow of a fine relief": STEPPED,
    "G12: edges of displaced neighbours": {"renderer.shapes.displacement.join": lambda _: None},
    "H1: rays in the plane of a box's side": {
        "renderer.accelerators.bvh.WIDENING": 0.0,
        "renderer.accelerators.bvh._slabs": shapes.bare_slabs,
    },
    "H2: rays at the edges of boxes": {
        "renderer.accelerators.bvh.WIDENING": 0.0,
        "renderer.accelerators.bvh.gamma": lambda _: 0.0,
    },
    "H3: boxes that are flat, points, or all in one place": {
        "renderer.accelerators.bvh._sorted_by_medians": shapes.shared_out_by_place,
    },
    "H4: rays that are not finite": {
        "renderer.tracing.finite": lambda values: np.ones(values.shape[1], dtype=bool)
    },
    "H10: faces that overlap in one plane": {
        "renderer.accelerators.bvh.AHEAD": 1.0,
        "renderer.accelerators.intersection.AHEAD": 1.0,
    },
    "H5: faces in one place": {"renderer.interaction.Rays.offer": shapes.first_come},
    "H11: shapes that overlap in one plane": {"renderer.plan.geometry.overlaps_of": lambda *_: None},
    "H6: the critical angle": {
        "renderer.materials.optics.transmitted_cosine": light.plain_transmitted_cosine
    },
    "H7: facing mirrors": {"renderer.plan.scattering.UNSEEN": 0.0},
    "H8: a ray that leaves glass": {
        "renderer.shapes.ellipsoids.Ellipsoids._departed": shapes.free_to_leave,
        # Rays that never get out would double with each bounce.
        "accuracy.hard_cases.trees_and_bounces.bounces.GLASS": {**GLASS, "max_depth": 4},
    },
    "H12: the edge of a glass block": {
        "renderer.materials.bounces.TransmittedRays._passed": lambda _, __, ___, chosen: np.zeros(
            chosen.size, bool
        )
    },
    "H9: glass of index 1": {"renderer.materials.optics.transmitted_cosine": light.plain_transmitted_cosine},
    "H13: corners of facing mirrors": {"renderer.self_intersection.NEAR": 0.0},
    "I1: a turned grid that leaves the pixel": {
        "accuracy.hard_cases.samples_and_output.samples.PATTERNS": {
            **PATTERNS,
            "rotated": light.not_wrapped,
        }
    },
    "I2: an edge through a pixel": {"renderer.integrator.PATTERNS": {**PATTERNS, "rotated": light.shrunk}},
    "I3: random numbers and tiles": {"renderer.samplers.bits": light.in_turn(1)},
    "I10: random numbers just below 1": {
        "accuracy.hard_cases.samples_and_output.samples.uniforms": lambda drawn: drawn * 2.0**-32
    },
    "I4: a million samples": {
        "accuracy.hard_cases.samples_and_output.samples.halving_sum": light.summed_in_order
    },
    "I5: samples that are nearly equal": {"renderer.layers.Spread.add": light.plain_spread},
    "I6: numbers that are no brightness": {OUTPUT: light.shown(clipped=False, rounded=True)},
    "I7: all codes there and back": {OUTPUT: light.shown(clipped=True, rounded=False)},
    "I8: the toe of the curve": {OUTPUT: light.shown(clipped=False, rounded=True)},
    "I9: very bright and quite black": {"renderer.film.BRIGHTEST": np.inf},
    "J1: NaN and infinity in a scene file": UNCHECKED,
    "J2: very large numbers": UNCHECKED,
    "J3: very small numbers": {"accuracy.hard_cases.scene_values.values.unit": shapes.plain_unit},
    "J4: counts that are none": UNCHECKED,
    "J5: vectors of length zero": UNCHECKED,
    "J6: a scene in units of another power of two": PROJECTED_WITH_LIMIT,
    "J6: a scene in other units": PROJECTED_WITH_LIMIT,
    "J7: a scene far from the origin": IN_SINGLE,
    "J8: a scene and its camera turned together": {
        "renderer.cameras.upward": lambda _: np.array([[0.0], [1.0], [0.0]])
    },
    "J9: tiles of any size": {"renderer.lights.view.halving_sum": lambda terms: np.add.reduce(terms, axis=0)},
    "J10: single against double precision": {
        "renderer.visibility.polygon_grids.shared_light": light.shared_light_of_rounded
    },
    "J11: fused products in edge functions": FUSED,
}


def fails(case: Case) -> bool:
    """Whether a case has a wrong answer, or breaks off; what comes after the first need not be tried."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return any(outcome.wrong for outcome in each_of(case.outcomes()))
        except (ArithmeticError, IndexError, ValueError):
            return True


def test_each_case_has_a_remedy_that_can_be_switched_off() -> None:
    assert SWITCHED_OFF.keys() == CASES.keys()


@pytest.mark.parametrize("heading", SWITCHED_OFF)
def test_a_case_fails_without_its_remedy(heading: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, instead in SWITCHED_OFF[heading].items():
        monkeypatch.setattr(name, instead)
    assert fails(CASES[heading])
