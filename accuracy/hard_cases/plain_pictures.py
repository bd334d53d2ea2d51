"""A textbook's picture of a ball on a floor under a bulb, in one precision throughout."""

import numpy as np

from accuracy.hard_cases.documents import Json
from renderer.math.arrays import Pairs

NEAREST = 1e-4
"""What a textbook takes for the least distance of a hit, whatever the unit."""


def plain_picture(document: Json, dtype: type[np.floating]) -> Pairs:
    """Grey values (H, W) of a scene of one rectangle, one sphere, and one bulb, by textbook formulas.

    The camera makes points of the virtual screen in the world, rays begin at hits, and what is nearer than
    `NEAREST` is not hit.
    """
    with np.errstate(all="ignore"):
        return _Plain(document, dtype).picture()


class _Plain:
    def __init__(self, document: Json, dtype: type[np.floating]) -> None:
        floor, ball = document["shapes"]
        self.dtype, self.camera = dtype, document["camera"]
        self.eye, self.target = self._column(self.camera["position"]), self._column(self.camera["look_at"])
        self.bulb = self._column(document["lights"][0]["position"])
        self.corner, self.center = self._column(floor["corner"]), self._column(ball["center"])
        self.first, self.second = (self._column(edge) for edge in floor["edges"])
        self.radius = dtype(ball["radius"])
        self.up = self._column(self.camera.get("up", [0, 1, 0]))

    def _column(self, vector: list[float]) -> Pairs:
        return np.array(vector, dtype=self.dtype).reshape(3, 1)

    def picture(self) -> Pairs:
        """Ambient, and diffuse light where no shape is in between."""
        screen = self._screen()
        directions = _unit(screen - self.eye)
        t, normals = self._hits(self.eye, directions)
        places = self.eye + t * directions
        to_light = self.bulb - places
        distance = np.sqrt((to_light * to_light).sum(axis=0))
        along = to_light / distance
        blocked, _ = self._hits(places, along)
        lit = np.abs((normals * along).sum(axis=0)) * ~(blocked < distance)
        grey = np.where(np.isfinite(t), self.dtype(0.2) + self.dtype(0.8) * lit, 0)
        return np.nan_to_num(grey).reshape(self.camera["height"], self.camera["width"])

    def _screen(self) -> Pairs:
        forward = _unit(self.target - self.eye)
        right = _unit(np.cross(forward, self.up, axis=0))
        up = np.cross(right, forward, axis=0)
        width, height = self.camera["width"], self.camera["height"]
        half = self.dtype(np.tan(np.radians(self.camera["vertical_fov"]) / 2))
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        across = (2 * x.ravel() / width - 1).astype(self.dtype) * half * self.dtype(width / height)
        along = (1 - 2 * y.ravel() / height).astype(self.dtype) * half
        return self.eye + forward + across * right + along * up

    def _hits(self, origins: Pairs, directions: Pairs) -> tuple[Pairs, Pairs]:
        """Nearest distance (N,) and normal (3, N)."""
        normal = _unit(np.cross(self.first, self.second, axis=0))
        floor = ((self.corner - origins) * normal).sum(axis=0) / (directions * normal).sum(axis=0)
        away = origins + floor * directions - self.corner
        u, v = ((away * edge).sum(axis=0) / (edge * edge).sum(axis=0) for edge in (self.first, self.second))
        inside = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1) & (floor > NEAREST)
        floor = np.where(inside, floor, np.inf)
        relative = origins - self.center
        b = (relative * directions).sum(axis=0)
        root = np.sqrt(b * b - (relative * relative).sum(axis=0) + self.radius * self.radius)
        ball = np.where(-b - root > NEAREST, -b - root, -b + root)
        ball = np.where(ball > NEAREST, ball, np.inf)
        bent = (origins + ball * directions - self.center) / self.radius
        return np.minimum(ball, floor), np.where(ball < floor, bent, normal)


def _unit(vectors: Pairs) -> Pairs:
    return vectors / np.sqrt((vectors * vectors).sum(axis=0))
