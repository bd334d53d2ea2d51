"""Hints for students: the probable mistake, and how to fix it."""

AMBIENT_HINT = (
    "The ambient term is missing. Add the scene's ambient light times the material's ambient coefficient "
    "and colour, once and not for each light."
)

HINTS = {
    "shadows_missing": (
        "There are no shadows. From each hit, cast a ray to the light point, and skip the light if a shape "
        "lies between."
    ),
    "hard_shadows": (
        "Shadows are hard: the light is treated as a point at its centre. Choose a new random point of "
        "the light for each shadow ray."
    ),
    "light_points_shared": (
        "Soft shadows have bands: every pixel uses the same few points of the light. Choose new points "
        "for each pixel and sample."
    ),
    "shadow_acne": (
        "Surfaces shadow themselves at random. Start shadow rays slightly above the surface, or ignore hits "
        "very close to their origin."
    ),
    "light_misplaced": (
        "The area light is sampled {}. Its points are corner + u e1 + v e2 with u and v from 0 to 1."
    ),
    "light_missing": (
        "{} has no effect. Sum over all lights, and end each shadow ray at the light: shapes behind the "
        "light cast no shadow."
    ),
    "falloff": (
        "Brightness falls off with distance where it should not, or the reverse. Check `falloff` of the "
        "lights."
    ),
    "ambient_missing": AMBIENT_HINT,
    "highlights_missing": (
        "There are no highlights. Check the specular term and the sign of the viewer's direction."
    ),
    "normal_map_missing": "The normal map has no effect. Turn its texels into normals and shade with them.",
    "bump_map_missing": "The bump map has no effect. Tilt the normal by the slopes of its heights.",
    "displacement_missing": "The displacement map has no effect. Move the surface, not only its normal.",
    "mirror_missing": "Mirrors reflect nothing. Trace a reflected ray, and add its radiance times `mirror`.",
    "transmission_missing": "Transparent surfaces are opaque. Trace a refracted ray through them.",
    "texture_missing": (
        "The texture is not shown. Look it up at the hit's uv in place of the material's colour."
    ),
    "lens_missing": "Everything is sharp. Start camera rays at random points of the lens.",
    "shape_missing": "{} is missing. Check how this shape is read, and its intersection.",
    "triangles_too_large": (
        "Triangles are drawn as parallelograms. A point is inside a triangle only if u + v <= 1 too."
    ),
    "field_of_view": "The field of view is {}: vertical_fov is the angle from the bottom to the top edge.",
    "aspect_ignored": (
        "The picture is stretched as if it were square. Multiply the horizontal offset of a ray by "
        "width / height."
    ),
    "up_ignored": (
        "The camera ignores `up`. Its right vector is unit(forward x up), and its own up vector is right x "
        "forward."
    ),
    "camera_axes_not_unit": (
        "The picture is scaled, because forward x up does not have length 1. Normalise it before you use it "
        "as the camera's right vector."
    ),
    "camera_axes_not_orthogonal": (
        "The picture is sheared, because the camera's axes are not perpendicular. Its up vector is right x "
        "forward, not `up` itself."
    ),
    "size_minus_one": (
        "Positions are divided by width - 1 and height - 1. A picture of width n ends at n: a sample at "
        "column x lies at 2 x / width - 1."
    ),
    "last_hit_drawn": (
        "The last shape that a ray hits is drawn. Keep the hit with the smallest t > 0, and replace it only "
        "by a nearer one."
    ),
    "texture_upside_down": "Textures are upside down. Row 0 of the file is v = 1, its last row v = 0.",
    "texture_mirrored": "Textures are mirrored. Column 0 of the file is u = 0.",
    "texture_turned": (
        "Textures are turned by 180 degrees. Column 0 of the file is u = 0, and row 0 is v = 1."
    ),
    "texture_transposed": "u and v are swapped. u counts the columns of the file, v its rows from below.",
    "texture_not_decoded": (
        "Texture colours are taken as linear. Decode sRGB texels before shading with them."
    ),
    "texture_decoded_twice": (
        "Texture colours are too dark: they are decoded twice, or are linear and decoded as sRGB."
    ),
    "normal_map_decoded": (
        "The normal map is decoded as if it were an sRGB picture. Its numbers are directions: use them as "
        "stored, n = 2 c - 1."
    ),
    "normal_map_green": (
        "The green channel of the normal map has the wrong sign. It counts along the cotangent, which is "
        "normal x tangent."
    ),
    "normal_map_swapped": (
        "Red and green of the normal map are swapped. Red counts along the tangent, green along the "
        "cotangent."
    ),
    "normal_map_not_shifted": "Texels of the normal map are used as normals. Shift them first: n = 2 c - 1.",
    "cosine_not_clamped": "Lights behind a surface subtract light from it. Use max(0, n . l).",
    "halfway_vector": (
        "Highlights have the wrong width: they use Blinn's (n . h), but Phong's (r . v) is required, with "
        "r = 2 (n . l) n - l."
    ),
    "shininess": "Highlights have the wrong width: their exponent is {} as `shininess`.",
    "highlight_not_clamped": (
        "Highlights appear where r . v is negative. Raise max(0, r . v) to the power of `shininess`."
    ),
    "normals_flipped": (
        "Normals point away from the viewer, so lights reach the wrong side of surfaces. Turn each normal n "
        "where n . d > 0 for the direction d of the ray."
    ),
    "light_not_normalised": "The vector to the light is not normalised before the cosine is computed.",
    "highlight_colored": (
        "Highlights have the colour of the surface. They should have that of the light: do not multiply "
        "`specular` by the material's colour."
    ),
    "normals_not_normalised": (
        "Normals do not have unit length: brightness depends on the size of shapes. Divide them by their "
        "length."
    ),
    "normals_of_spheres": (
        "Ellipsoids have the normals of spheres. Their normal is M^-T x, normalised, for the point x on the "
        "unit sphere."
    ),
}
"""By cause; a pair of braces is filled with a detail of the scene."""
