"""What a student is told about a mistake: what was probably done, and what to do."""

HINTS = {
    "shadows_missing": (
        "There are no shadows. From each hit, cast a ray to the light point, and leave the light out where a "
        "shape lies between."
    ),
    "hard_shadows": (
        "Shadows are hard: the light counts as one point in its middle. Choose a new random point of the "
        "light for each shadow ray."
    ),
    "light_points_shared": (
        "Soft shadows have bands: every pixel sees the same few points of the light. Choose points of its "
        "own for each pixel and sample."
    ),
    "light_misplaced": (
        "The area light is sampled {}. Its points are corner + u e1 + v e2 with u and v from 0 to 1."
    ),
    "light_missing": (
        "{} lights nothing. Sum over all lights; and a shadow ray ends at the light: what lies behind the "
        "light throws no shadow."
    ),
    "falloff": (
        "Brightness falls with the distance where it should not, or does not where it should. Look at "
        "`falloff` of the lights."
    ),
    "ambient_missing": (
        "The ambient term is missing. Add the scene's ambient light times the material's ambient share and "
        "its colour, once and not for each light."
    ),
    "highlights_missing": (
        "There are no highlights. Look at the specular term, and at the sign of the viewer's direction."
    ),
    "normal_map_missing": (
        "The normal map changes nothing. Turn its texels into normals and shade with these."
    ),
    "bump_map_missing": "The bump map changes nothing. Tilt the normal by the slopes of its heights.",
    "displacement_missing": "Nothing is displaced. Move the surface itself, not only its shading normal.",
    "mirror_missing": "Mirrors reflect nothing. Send a ray from them, and add what it sees times `mirror`.",
    "transmission_missing": "Nothing is seen through surfaces. Send a refracted ray through them.",
    "texture_missing": (
        "The texture is not shown. Look it up at the hit's uv in place of the material's colour."
    ),
    "lens_missing": "Everything is sharp. Let rays start at random places of the lens.",
    "shape_missing": "{} is missing. Look at how this shape is read, and at its intersection.",
    "triangles_too_large": (
        "Triangles are drawn as parallelograms. A place is inside of one only where u + v <= 1 too."
    ),
    "field_of_view": "The angle of view is {}: vertical_fov goes from the lower to the upper border.",
    "aspect_ignored": (
        "The picture is stretched as if it were as wide as high. Multiply the horizontal offset of a ray by "
        "width / height."
    ),
    "up_ignored": (
        "The picture is not turned as `up` asks for. The camera's right is unit(forward x up), and its own "
        "upwards direction is right x forward."
    ),
    "texture_upside_down": "Textures are upside down. Row 0 of the file is v = 1, its last row v = 0.",
    "texture_mirrored": "Textures are mirrored. Column 0 of the file is u = 0.",
    "texture_turned": (
        "Textures are turned by 180 degrees. Column 0 of the file is u = 0, and row 0 is v = 1."
    ),
    "texture_transposed": "u and v are exchanged. u counts the columns of the file, v its rows from below.",
    "texture_not_decoded": (
        "Colours of textures are taken as linear. Decode sRGB texels before shading with them."
    ),
    "texture_decoded_twice": (
        "Colours of textures are too dark: they are decoded twice, or are linear and are decoded as sRGB."
    ),
    "normal_map_decoded": (
        "The normal map is decoded as if it were a picture in sRGB. Its numbers are directions: take them as "
        "they are stored, n = 2 c - 1."
    ),
    "normal_map_green": (
        "The green channel of the normal map has the wrong sign. It counts along the cotangent, which is "
        "normal x tangent."
    ),
    "normal_map_swapped": (
        "Red and green of the normal map are exchanged. Red counts along the tangent, green along the "
        "cotangent."
    ),
    "normal_map_not_shifted": "Texels of the normal map are taken for normals. Shift them: n = 2 c - 1.",
    "cosine_not_clamped": "Lamps behind a surface take light away from it. Use max(0, n . l).",
    "halfway_vector": (
        "Highlights have the wrong width: they are Blinn's (n . h), where Phong's (r . v) is asked for, with "
        "r = 2 (n . l) n - l."
    ),
    "light_not_normalised": "The vector to the light is not of unit length when the cosine is taken.",
    "highlight_colored": (
        "Highlights have the colour of the surface. They have that of the light: `specular` is not "
        "multiplied by the material's colour."
    ),
    "normals_not_normalised": (
        "Normals are not of unit length: brightness changes with the size of shapes. Divide them by their "
        "length."
    ),
    "normals_of_spheres": (
        "Ellipsoids have the normals of spheres. Their normal is M^-T x, of unit length, for the place x on "
        "the unit sphere."
    ),
}
"""By causes; a pair of braces stands for what is known about this scene."""
