"""Contributions of the parts of an inspected pixel, as shares of its brightness."""

from collections.abc import Iterator

from schemas.api.inspections import InspectedLight, InspectedRay, Triple

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of linear red, green and blue in luminance (ITU-R BT.709)."""

NEGLIGIBLE_SHARE = 0.0005
"""Shares up to this are shown as 0.0 %, and explain nothing."""


class Shares:
    """Shares, 0 to 1, of the brightness of a pixel; all are 0 in a black one.

    Attributes
    ----------
    total : float
        Luminance of the pixel: of all rays, weighted.
    """

    def __init__(self, camera_ray: InspectedRay) -> None:
        self.total = _beyond(camera_ray)

    def of_light(self, ray: InspectedRay, light: InspectedLight) -> float:
        """Contribution of a light at the hit of a ray."""
        return self._share(ray.weight * (luminance(light.diffuse) + luminance(light.specular)))

    def unblocked(self, ray: InspectedRay, light: InspectedLight) -> float:
        """Contribution of a light at the hit of a ray if nothing blocked it; it may exceed 1."""
        return self._share(ray.weight * luminance(light.unblocked))

    def of_ambient(self, ray: InspectedRay) -> float:
        """Contribution of ambient light at the hit of a ray."""
        return self._share(ray.weight * luminance(ray.surface.ambient)) if ray.surface else 0.0

    def own(self, ray: InspectedRay) -> float:
        """Contribution of the point where a ray ends."""
        return self._share(_own(ray))

    def beyond(self, ray: InspectedRay) -> float:
        """Contribution of a ray with all rays scattered from its end."""
        return self._share(_beyond(ray))

    def brightest(self, ray: InspectedRay) -> InspectedRay:
        """The ray whose own hit adds most, among a ray and all scattered from it."""
        return max(_tree(ray), key=_own)

    def _share(self, amount: float) -> float:
        return amount / self.total if self.total > 0 else 0.0


def luminance(color: Triple) -> float:
    """Luminance of linear RGB."""
    return sum(weight * value for weight, value in zip(LUMINANCE, color, strict=True))


def _own(ray: InspectedRay) -> float:
    return ray.weight * luminance(ray.radiance)


def _beyond(ray: InspectedRay) -> float:
    return sum(map(_own, _tree(ray)))


def _tree(ray: InspectedRay) -> Iterator[InspectedRay]:
    yield ray
    for following in ray.rays:
        yield from _tree(following)
