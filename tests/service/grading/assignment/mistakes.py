"""Programs with one mistake each: the files that lose their points, with the cause that is reported."""

from dataclasses import dataclass

RAYS = ("rays_round", "rays_flat", "rays_far")
ROUND = ("phong_matte", "phong_highlights", "shadow_hard", "shadow_soft")
LIT = (*ROUND, "normal_map")
SHADOWS = ("shadow_hard", "shadow_soft")
CURVED = ("rays_round", "rays_far")
ALL = ("camera_tilted", "phong_matte", "antialiasing")
"""A sample of the pictures, for mistakes that change all alike."""

FLAT = ("phong_matte", *SHADOWS, "antialiasing")
ADVANCED, EDGES = ("antialiasing_advanced",), ("antialiasing", "antialiasing_advanced")
TEXTURE, BUMPS, SOFT, SHINE = ("texture",), ("normal_map",), ("shadow_soft",), ("phong_highlights",)


@dataclass(frozen=True)
class Mistake:
    """A switch of the tracer, the files to grade, and for each cause or words the files that lose points."""

    name: str
    tried: tuple[str, ...]
    fails: dict[str, tuple[str, ...]]

    @property
    def causes(self) -> dict[str, str]:
        return {file: cause for cause, files in self.fails.items() for file in files if file in self.tried}


NEAREST, LENGTH = "take the nearest", "do not have length 1"
TILTED = ("camera_tilted",)

MISTAKES = (
    Mistake("upside_down", ALL, {"flipped_vertically": TILTED}),
    Mistake("one_pixel_off", ALL, {"one_pixel_left": TILTED}),
    Mistake("fov_not_halved", ALL, {"field_of_view": ALL}),
    Mistake("aspect_ignored", ALL, {"aspect_ignored": ALL}),
    Mistake("up_ignored", ALL, {"up_ignored": TILTED}),
    Mistake("gamma_missing", ALL, {"gamma_missing": TILTED}),
    Mistake("gamma_power", ALL, {}),
    Mistake("shape_missing", (*ROUND, *RAYS), {"shape_missing": ROUND, "No ray hits": CURVED}),
    Mistake("far_clipped", RAYS, {"does not end": ("rays_far",)}),
    Mistake("far_single", RAYS, {"calculate in float64": ("rays_far",)}),
    Mistake("directions_normalised", RAYS, {"t is a distance": RAYS}),
    Mistake("behind", RAYS, {"only t > 0 counts": RAYS}),
    Mistake("last_shape_wins", RAYS, {NEAREST: RAYS}),
    Mistake(
        "triangle_too_large",
        (*FLAT, *RAYS),
        {"triangles_too_large": FLAT, "should miss": ("rays_flat", "rays_far")},
    ),
    Mistake("normals_not_normalised", (*LIT, *RAYS), {"normals_not_normalised": ROUND, LENGTH: RAYS}),
    Mistake(
        "normal_like_points", (*ROUND, *RAYS), {"normals_of_spheres": ROUND, "normals of spheres": CURVED}
    ),
    Mistake("blinn", LIT, {"halfway_vector": SHINE}),
    Mistake("no_max", LIT, {"cosine_not_clamped": ("phong_matte", "shadow_hard"), "": SOFT}),
    Mistake("no_ambient", LIT, {"ambient_missing": ("phong_matte", "phong_highlights")}),
    Mistake("light_not_normalised", LIT, {"light_not_normalised": ROUND}),
    Mistake("no_shadows", LIT, {"shadows_missing": SHADOWS}),
    Mistake("hard_shadow", LIT, {"hard_shadows": SOFT}),
    Mistake("shadow_ray_endless", LIT, {"light_missing": SHADOWS}),
    Mistake("same_light_points", LIT, {"light_points_shared": SOFT}),
    Mistake("one_sample", EDGES, {"antialiasing_missing": EDGES}),
    Mistake("texture_upside_down", TEXTURE, {"texture_upside_down": TEXTURE}),
    Mistake("texture_not_decoded", TEXTURE, {"texture_not_decoded": TEXTURE}),
    Mistake("normal_map_srgb", BUMPS, {"normal_map_decoded": BUMPS}),
    Mistake("normal_map_green", BUMPS, {"normal_map_green": BUMPS}),
    Mistake("normal_map_ignored", BUMPS, {"normal_map_missing": BUMPS}),
    Mistake("plain_random", ADVANCED, {"": ADVANCED}),
)

NOISELESS = (
    ("shininess_doubled", "phong_highlights", "shininess"),
    ("specular_unclamped", "phong_highlights", "highlight_not_clamped"),
    ("normal_flipped", "phong_matte", "normals_flipped"),
    ("normal_flipped", "shadow_hard", "normals_flipped"),
    ("normal_flipped", "normal_map", ""),  # as dark as without the only light: two causes, so none is named
    ("acne", "shadow_hard", "shadow_acne"),
    ("acne", "normal_map", "shadow_acne"),
    ("axes_not_unit", "camera_tilted", "camera_axes_not_unit"),
    ("axes_not_orthogonal", "camera_tilted", "camera_axes_not_orthogonal"),
    ("size_minus_one", "camera_straight", "size_minus_one"),
)
"""Mistakes, files and causes that are found in a single picture."""

CAMERA_TESTS = frozenset({"camera-straight", "camera-tilted"})
PHONG_TESTS = frozenset({"phong-matte", "phong-highlights"})
EDGE_TESTS = frozenset({"antialiasing", "antialiasing-advanced"})

WHOLE = (
    (("corner_sampling",), EDGE_TESTS, {"antialiasing_missing"}),
    (("gamma_power",), frozenset[str](), set[str]()),
    (("upside_down", "gamma_missing"), CAMERA_TESTS, {"flipped_vertically", "gamma_missing"}),
    (("bgr", "half_pixel_off"), CAMERA_TESTS, {"channels_bgr", "half_pixel_right_down"}),
    (("no_ambient", "brighter"), PHONG_TESTS, {"ambient_missing", "exposure"}),
)
"""Mistakes of whole programs, the tests that they cost points in, and all causes named there."""
