"""What an exact answer about a ray says."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Answer:
    """What a ray meets.

    Attributes
    ----------
    hit : bool
    margin : float
        Distance of the ray from the border line of the shape, in shares of the largest coordinate. For an
        ellipsoid, at most its distance from the outline that the ray sees.
    t : float
        In units of the direction; inf for a miss.
    position, normal : tuple of float
        The normal is on the side the ray comes from. Empty for a miss.
    uv : tuple of float
    """

    hit: bool
    margin: float
    t: float = math.inf
    position: tuple[float, ...] = ()
    normal: tuple[float, ...] = ()
    uv: tuple[float, ...] = ()
