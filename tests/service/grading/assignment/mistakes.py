"""Submissions with one mistake each: the tests that lose points, and the cause that is reported."""

from dataclasses import dataclass, field

PICTURES = (
    "camera_straight",
    "camera_tilted",
    "phong_matte",
    "phong_highlights",
    "shadow_hard",
    "shadow_soft",
    "antialiasing",
    "texture",
    "normal_map",
    "antialiasing_advanced",
)
RAYS = ("rays_round", "rays_flat", "rays_far")
LIT = ("phong_matte", "phong_highlights", "shadow_hard", "shadow_soft", "normal_map")
ROUND = ("phong_matte", "phong_highlights", "shadow_hard", "shadow_soft")
SHADOWS = ("shadow_hard", "shadow_soft")
CAMERA = ("camera_straight", "camera_tilted")


@dataclass(frozen=True)
class Mistake:
    """One mistake of a program.

    Attributes
    ----------
    name : str
        Its name in `Tracer`.
    words : str
        What the program does.
    touches : tuple of str
        Files that the mistake may change.
    fails : dict of str to str
        Files that lose their points, each with the reported cause; for rays, words of the message.
    """

    name: str
    words: str
    touches: tuple[str, ...]
    fails: dict[str, str] = field(default_factory=dict)

    @property
    def tried(self) -> tuple[str, ...]:
        """Files to grade: a sample if all pictures change alike."""
        if self.touches != PICTURES:
            return self.touches
        return "camera_tilted", "phong_matte", "antialiasing"


def of(cause: str, *names: str) -> dict[str, str]:
    return dict.fromkeys(names, cause)


NEAREST = "take the nearest"
LENGTH = "do not have length 1"

MISTAKES = (
    Mistake(
        "upside_down",
        "rows are counted from below",
        PICTURES,
        of("flipped_vertically", *CAMERA),
    ),
    Mistake(
        "mirrored",
        "the camera's right points to the left",
        PICTURES,
        of("flipped_horizontally", *CAMERA),
    ),
    Mistake(
        "one_pixel_off",
        "columns are counted from 1",
        PICTURES,
        of("one_pixel_left", *CAMERA),
    ),
    Mistake("fov_not_halved", "tan(fov) for tan(fov / 2)", PICTURES, of("field_of_view", *PICTURES)),
    Mistake(
        "fov_horizontal", "the field of view is taken as horizontal", PICTURES, of("field_of_view", *PICTURES)
    ),
    Mistake("aspect_ignored", "width / height is left out", PICTURES, of("aspect_ignored", *PICTURES)),
    Mistake("up_ignored", "up is always (0, 1, 0)", PICTURES, of("up_ignored", "camera_tilted")),
    Mistake(
        "gamma_missing",
        "numbers are saved as they are, linear",
        PICTURES,
        of("gamma_missing", *CAMERA),
    ),
    Mistake(
        "gamma_twice",
        "numbers are encoded for the display twice",
        PICTURES,
        of("gamma_twice", *CAMERA),
    ),
    Mistake("gamma_power", "a power of 1 / 2.2 for sRGB", PICTURES),
    Mistake(
        "shape_missing",
        "ellipsoids are not drawn, only spheres",
        (*ROUND, *RAYS),
        of("shape_missing", *ROUND) | of("No ray hits", "rays_round", "rays_far"),
    ),
    Mistake("far_clipped", "rays end at t = 1000", RAYS, of("does not end", "rays_far")),
    Mistake(
        "far_single",
        "quadratics are solved in float32",
        RAYS,
        of("calculate in float64", "rays_far"),
    ),
    Mistake("directions_normalised", "t counts lengths, not directions", RAYS, of("t is a distance", *RAYS)),
    Mistake("behind", "t < 0 counts as a hit", RAYS, of("only t > 0 counts", *RAYS)),
    Mistake("last_shape_wins", "the last shape hit is drawn, not the nearest", RAYS, of(NEAREST, *RAYS)),
    Mistake("second_root", "spheres are hit at their far side", RAYS, of(NEAREST, "rays_round", "rays_far")),
    Mistake(
        "triangle_too_large",
        "u + v <= 1 is not checked",
        ("phong_matte", *SHADOWS, "antialiasing", *RAYS),
        of("triangles_too_large", "phong_matte", *SHADOWS, "antialiasing")
        | of("should miss", "rays_flat", "rays_far"),
    ),
    Mistake(
        "normals_not_normalised",
        "normals are not normalised",
        (*LIT, *RAYS),
        of("normals_not_normalised", *ROUND) | of(LENGTH, *RAYS),
    ),
    Mistake(
        "normal_like_points",
        "ellipsoids have the normals of spheres",
        (*ROUND, *RAYS),
        of("normals_of_spheres", *ROUND) | of("normals of spheres", "rays_round", "rays_far"),
    ),
    Mistake("no_highlight", "no specular term", LIT, of("highlights_missing", "phong_highlights")),
    Mistake("blinn", "(n . h) for (r . v)", LIT, of("halfway_vector", "phong_highlights")),
    Mistake(
        "no_max",
        "n . l in place of max(0, n . l)",
        LIT,
        of("cosine_not_clamped", "phong_matte", "shadow_hard") | of("", "shadow_soft"),
    ),
    Mistake("no_ambient", "no ambient term", LIT, of("ambient_missing", "phong_matte", "phong_highlights")),
    Mistake(
        "light_not_normalised",
        "the vector to the light keeps its length",
        LIT,
        of("light_not_normalised", *ROUND),
    ),
    Mistake("no_shadows", "no shadow rays", LIT, of("shadows_missing", *SHADOWS)),
    Mistake("hard_shadow", "the lamp is one point", LIT, of("hard_shadows", "shadow_soft")),
    Mistake("shadow_ray_endless", "shadow rays continue beyond the lamp", LIT, of("light_missing", *SHADOWS)),
    Mistake(
        "same_light_points",
        "all pixels see the same 16 points of the lamp",
        LIT,
        of("light_points_shared", "shadow_soft"),
    ),
    Mistake("light_off_center", "the lamp begins at its middle", LIT, of("light_misplaced", "shadow_soft")),
    Mistake(
        "one_sample",
        "one sample in the middle of a pixel",
        PICTURES,
        of("antialiasing_missing", "antialiasing", "antialiasing_advanced"),
    ),
    Mistake("texture_upside_down", "row 0 is v = 0", ("texture",), of("texture_upside_down", "texture")),
    Mistake("texture_mirrored", "column 0 is u = 1", ("texture",), of("texture_mirrored", "texture")),
    Mistake(
        "texture_not_decoded",
        "sRGB texels are not decoded",
        ("texture",),
        of("texture_not_decoded", "texture"),
    ),
    Mistake(
        "normal_map_srgb",
        "the normal map is read as sRGB",
        ("normal_map",),
        of("normal_map_decoded", "normal_map"),
    ),
    Mistake(
        "normal_map_green",
        "green counts downwards",
        ("normal_map",),
        of("normal_map_green", "normal_map"),
    ),
    Mistake(
        "normal_map_swapped",
        "red and green are swapped",
        ("normal_map",),
        of("normal_map_swapped", "normal_map"),
    ),
    Mistake(
        "normal_map_ignored",
        "the normal map is ignored",
        ("normal_map",),
        of("normal_map_missing", "normal_map"),
    ),
    Mistake("plain_random", "16 random places", ("antialiasing_advanced",), of("", "antialiasing_advanced")),
    Mistake(
        "upright_grid",
        "an upright grid of 4 x 4",
        ("antialiasing_advanced",),
        of("", "antialiasing_advanced"),
    ),
)
