"""Terms that a material's model of reflection gives to every light."""

from dataclasses import dataclass
from typing import Literal, Protocol

from renderer.lights.view import LightView
from renderer.math.arrays import Masks


class LightTerm(Protocol):
    """Stage of a light that adds to the points' radiance."""

    @property
    def adds(self) -> Literal["diffuse", "specular"]:
        """The part of the radiance that it adds to.

        The diffuse part is proportional to the colour, and the specular part does not depend on it: pixels in
        which only colours vary are lit once, and coloured at many points.
        """
        ...

    def run(self, view: LightView) -> None:
        """Add the mean over light points of V * light * the reflected share."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A term of all lights, as plans list it.

    Attributes
    ----------
    stage : LightTerm
    name, detail : str
    used : (K,) bool
        Materials that request it.
    share : float
        Share of the materials whose points it works on.
    viewed : bool
        Whether it reads the viewers of points.
    """

    stage: LightTerm
    name: str
    detail: str
    used: Masks
    share: float
    viewed: bool = False
