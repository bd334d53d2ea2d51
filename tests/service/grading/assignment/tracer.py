"""A student's ray tracer: solves the assignment with random samples, and makes mistakes on purpose.

It shares no code with the package that grades it. Each mistake has a name, and an `if` beside the right code.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from tests.service.grading.assignment.shapes import Array, Ball, Flat, Json, Wrong, dot, shape_of, unit

RIGHT: Wrong = frozenset()
SAMPLES = 16
ADVANCED = "antialiasing_advanced"
"""The scene that needs better sample positions than random ones."""

OFFSET = 1e-4
"""Offset of shadow rays above their surface, in scene units."""


class Tracer:
    """A scene, the names of the mistakes to make, and a random generator."""

    def __init__(self, scene: Json, folder: Path, wrong: Wrong = RIGHT, seed: int = 0) -> None:
        self.scene, self.wrong = scene, wrong
        self.random = np.random.default_rng(seed)
        kept = [shape for shape in scene["shapes"] if "shape_missing" not in wrong or "axes" not in shape]
        self.shapes = [shape_of(shape) for shape in kept]
        self.numbers = np.array([scene["shapes"].index(shape) for shape in kept] + [-1])
        self.materials = [scene["materials"][shape["material"]] for shape in kept]
        self.textures = scene.get("textures", {})
        self.files = {
            name: np.asarray(Image.open(folder / texture["asset"]).convert("RGB")) / 255
            for name, texture in self.textures.items()
            if texture["type"] == "image"
        }

    def picture(self, samples: int = SAMPLES, pattern: str = "random") -> Array:
        """The linear picture, (H, W, 3)."""
        return self.averaged(self.colors, samples, pattern)

    def normal_picture(self, samples: int = SAMPLES) -> Array:
        """Normals n as (n + 1) / 2, black for misses, (H, W, 3)."""
        return self.averaged(self.normal_colors, samples, "random")

    def averaged(self, seen: Callable[[Array, Array], Array], samples: int, pattern: str) -> Array:
        height, width = (self.scene["camera"][side] for side in ("height", "width"))
        j, i = np.mgrid[:height, :width].reshape(2, -1)
        total = np.zeros((height * width, 3))
        if "one_sample" in self.wrong:
            samples, pattern = 1, "center"
        if "corner_sampling" in self.wrong:
            samples, pattern = 1, "corner"
        for number in range(samples):
            a, b = self.places(number, samples, pattern, i.size)
            total += seen(*self.rays(i + a, j + b))
        return (total / samples).reshape(height, width, 3)

    def places(self, number: int, samples: int, pattern: str, count: int) -> tuple[Array, Array]:
        """Positions of a sample in its pixels, 0 to 1."""
        side = round(samples**0.5)
        column, row = number % side, number // side
        if pattern == "center":
            return np.full(count, 0.5), np.full(count, 0.5)
        if pattern == "corner":
            return np.zeros(count), np.zeros(count)
        if pattern == "grid":
            return np.full(count, (column + 0.5) / side), np.full(count, (row + 0.5) / side)
        if pattern == "tent":
            a, b = self.random.random((2, 2, count)).sum(axis=1) - 0.5
            return a, b
        a, b = self.random.random((2, count))
        return ((column + a) / side, (row + b) / side) if pattern == "jittered" else (a, b)

    def rays(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Origins and directions of rays through points of the picture, in pixels from the upper left."""
        camera, wrong = self.scene["camera"], self.wrong
        f, r, u = self.axes()
        angle = np.radians(camera["vertical_fov"])
        h = np.tan(angle if "fov_not_halved" in wrong else angle / 2)
        aspect = camera["width"] / camera["height"]
        if "aspect_ignored" in wrong:
            aspect = 1
        if "one_pixel_off" in wrong:
            x = x + 1
        if "half_pixel_off" in wrong:
            x, y = x - 0.5, y - 0.5
        less = 1 if "size_minus_one" in wrong else 0
        across, down = 2 * x / (camera["width"] - less) - 1, 1 - 2 * y / (camera["height"] - less)
        if "upside_down" in wrong:
            down = -down
        d = f + np.outer(across * h * aspect, r) + np.outer(down * h, u)
        return np.broadcast_to(np.array(camera["position"], float), d.shape), unit(d)

    def axes(self) -> tuple[Array, Array, Array]:
        """The camera's forward, right and up vectors."""
        camera, wrong = self.scene["camera"], self.wrong
        up = np.array((0, 1, 0) if "up_ignored" in wrong else camera.get("up", (0, 1, 0)), float)
        f = unit(np.array(camera["look_at"]) - np.array(camera["position"], float))
        r = np.cross(f, up)
        if "axes_not_unit" not in wrong:
            r = unit(r)
        return f, r, unit(up) if "axes_not_orthogonal" in wrong else np.cross(r, f)

    def hits(self, origins: Array, directions: Array) -> tuple[Array, Array]:
        """t of the nearest hit, and the index of its shape or -1."""
        nearest, number = np.full(len(directions), np.inf), np.full(len(directions), -1)
        for i, shape in enumerate(self.shapes):
            t = shape.distances(origins, directions, self.wrong)
            if "far_clipped" in self.wrong:
                t = np.where(t < 1000, t, np.inf)
            closer = np.isfinite(t) if "last_shape_wins" in self.wrong else t < nearest
            nearest[closer], number[closer] = t[closer], i
        return nearest, number

    def normals(self, number: Array, places: Array, directions: Array) -> Array:
        """Normals that face the ray origins."""
        found = np.zeros(places.shape)
        for i in np.unique(number[number >= 0]):
            seen = number == i
            outward = self.shapes[i].normals(places[seen], self.wrong)
            found[seen] = self.facing(outward, -directions[seen]) * outward
        return found

    def facing(self, outward: Array, viewers: Array) -> Array:
        """1 where outward normals face the viewer, -1 where they must be turned, (N, 1)."""
        sign = np.where(dot(outward, viewers) < 0, -1.0, 1.0)[:, None]
        return -sign if "normal_flipped" in self.wrong else sign

    def normal_colors(self, origins: Array, directions: Array) -> Array:
        t, number = self.hits(origins, directions)
        places = origins + np.where(number < 0, 0, t)[:, None] * directions
        return np.where((number >= 0)[:, None], (self.normals(number, places, directions) + 1) / 2, 0)

    def colors(self, origins: Array, directions: Array) -> Array:
        t, number = self.hits(origins, directions)
        total = np.tile(np.array(self.scene["background"], float), (len(t), 1))
        for i in np.unique(number[number >= 0]):
            seen = number == i
            places = origins[seen] + t[seen, None] * directions[seen]
            total[seen] = self.shade(i, places, -directions[seen])
        return total

    def shade(self, i: int, places: Array, viewers: Array) -> Array:
        shape, material = self.shapes[i], self.materials[i]
        outward = shape.normals(places, self.wrong)
        facing = self.facing(outward, viewers)
        color = self.color(material, shape.coordinates(places))
        normals = facing * outward
        if material.get("normal_map") and "normal_map_ignored" not in self.wrong:
            normals = facing * self.mapped(material["normal_map"], shape, places, outward)
        ambient = 0 if "no_ambient" in self.wrong else material["ambient"]
        total = np.array(self.scene["ambient"]) * ambient * color
        above = places + (0.0 if "acne" in self.wrong else OFFSET) * facing * outward
        for light in self.scene["lights"]:
            towards, reach = self.light_points(light, places)
            l = towards if "light_not_normalised" in self.wrong else unit(towards)
            share = self.seen(i, above, towards, reach)[:, None]
            total = total + share * np.array(light["color"]) * self.phong(
                material, color, normals, l, viewers
            )
        return total

    def phong(self, material: Json, color: Array, n: Array, l: Array, v: Array) -> Array:
        lambert = dot(n, l)[:, None]
        lit, shininess = lambert > 0, material.get("shininess", 1)
        if "shininess_doubled" in self.wrong:
            shininess = 2 * shininess
        gloss = dot(n, unit(l + v)) if "blinn" in self.wrong else dot(2 * lambert * n - l, v)
        if "specular_unclamped" not in self.wrong:
            gloss = np.maximum(gloss, 0)
        high = np.where(lit[:, 0], gloss**shininess, 0)[:, None]
        if "no_max" not in self.wrong:
            lambert = np.maximum(lambert, 0)
        return material["diffuse"] * color * lambert + material.get("specular", 0) * high

    def light_points(self, light: Json, places: Array) -> tuple[Array, float]:
        """Vectors from each point to a point of the light, and the t at which shadow rays end."""
        if light["type"] == "directional":
            return np.broadcast_to(-np.array(light["direction"], float), places.shape), np.inf
        if light["type"] == "point":
            return np.array(light["position"]) - places, 1.0
        shares = self.random.random((len(places), 2))
        if "hard_shadow" in self.wrong:
            shares[:] = 0.5
        if "same_light_points" in self.wrong:
            shares[:] = shares[0]
        return np.array(light["corner"]) + shares @ np.array(light["edges"]) - places, 1.0

    def seen(self, own: int, places: Array, towards: Array, reach: float) -> Array:
        """1 where the light is visible, 0 where it is blocked."""
        seen = np.ones(len(places), bool)
        if "no_shadows" in self.wrong:
            return seen.astype(float)
        if "shadow_ray_endless" in self.wrong:
            reach = np.inf
        for i, shape in enumerate(self.shapes):
            if i != own or isinstance(shape, Ball) or "acne" in self.wrong:
                seen &= shape.distances(places, towards, self.wrong) >= reach
        return seen.astype(float)

    def color(self, material: Json, coordinates: Array) -> Array:
        name = material.get("color_texture")
        if name is None:
            return np.array(material["color"], float)
        texture, (u, v) = self.textures[name], coordinates.T
        if texture["type"] == "checker":
            fields = np.floor(u * texture["repeat"][0]) + np.floor(v * texture["repeat"][1])
            return np.where((fields % 2 == 0)[:, None], texture["even"], texture["odd"])
        return self.looked_up(name, u, v)

    def looked_up(self, name: str, u: Array, v: Array) -> Array:
        """Bilinear interpolation of a texture."""
        texels = self.files[name]
        srgb = self.textures[name]["encoding"] == "srgb"
        if ("texture_not_decoded" in self.wrong and srgb) or ("normal_map_srgb" in self.wrong and not srgb):
            srgb = not srgb
        if srgb:
            texels = np.where(texels <= 0.04045, texels / 12.92, ((texels + 0.055) / 1.055) ** 2.4)
        if "texture_upside_down" in self.wrong:
            v = 1 - v
        height, width = texels.shape[:2]
        x, y = u * width - 0.5, (1 - v) * height - 0.5
        i, j = np.floor(x).astype(int), np.floor(y).astype(int)
        a, b = (x - i)[:, None], (y - j)[:, None]
        left, right = np.clip(i, 0, width - 1), np.clip(i + 1, 0, width - 1)
        top, low = np.clip(j, 0, height - 1), np.clip(j + 1, 0, height - 1)
        upper = texels[top, left] * (1 - a) + texels[top, right] * a
        lower = texels[low, left] * (1 - a) + texels[low, right] * a
        return upper * (1 - b) + lower * b

    def mapped(self, name: str, shape: Ball | Flat, places: Array, outward: Array) -> Array:
        """Outward normals from a normal map on a flat shape."""
        assert isinstance(shape, Flat)
        x, y, z = (self.looked_up(name, *shape.coordinates(places).T) * 2 - 1).T
        if "normal_map_green" in self.wrong:
            y = -y
        tangent, outward = unit(shape.first), unit(outward)
        return unit(np.outer(x, tangent) + y[:, None] * np.cross(outward, tangent) + z[:, None] * outward)


def encoded(linear: Array, wrong: Wrong = RIGHT) -> Array:
    """Encode a linear picture as 8-bit sRGB codes."""

    def srgb(x: Array) -> Array:
        return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)

    values = np.clip(1.1 * linear if "brighter" in wrong else linear, 0, 1)
    if "bgr" in wrong:
        values = values[:, :, ::-1]
    if "gamma_power" in wrong:
        return np.round(values ** (1 / 2.2) * 255).astype(np.uint8)
    return np.round((values if "gamma_missing" in wrong else srgb(values)) * 255).astype(np.uint8)


def read(scenes: Path, name: str) -> Json:
    loaded: Json = json.loads(scenes.joinpath(f"{name}.json").read_text())
    return loaded


def names(scenes: Path) -> Iterator[str]:
    """The scenes of a folder, without `.json`."""
    yield from sorted(file.stem for file in scenes.glob("*.json"))


def save(
    scenes: Path, out: Path, name: str, wrong: Wrong = RIGHT, samples: int = SAMPLES, seed: int = 0
) -> None:
    """Save the file to hand in for a scene: hits if rays are given for it, else a picture."""
    tracer, rays = Tracer(read(scenes, name), scenes, wrong, seed), scenes / f"{name}.npz"
    if not rays.exists():
        pattern = "random"
        if name == ADVANCED and "plain_random" not in wrong:
            pattern = "jittered"
        Image.fromarray(encoded(tracer.picture(samples, pattern), wrong)).save(out / f"{name}.png")
        return
    with np.load(rays) as given:
        origins, directions = given["origins"], given["directions"]
    if "directions_normalised" in wrong:
        directions = unit(directions)
    t, shape = tracer.hits(origins, directions)
    places = origins + np.where(shape < 0, 0, t)[:, None] * directions
    normals = tracer.normals(shape, places, directions)
    np.savez(out / f"{name}.npz", t=t, position=places, normal=normals, shape=tracer.numbers[shape])


def run(scenes: Path, out: Path, wrong: Wrong = RIGHT, samples: int = SAMPLES, seed: int = 0) -> None:
    """Write the files for all scenes of a folder, and pictures of normals for the tables of rays."""
    out.mkdir(parents=True, exist_ok=True)
    for name in names(scenes):
        save(scenes, out, name, wrong, samples, seed)
        if scenes.joinpath("references", f"{name}_normals.npz").exists():
            normals = Tracer(read(scenes, name), scenes, wrong, seed).normal_picture(samples)
            Image.fromarray(np.round(255 * normals).astype(np.uint8)).save(out / f"{name}_normals.png")
