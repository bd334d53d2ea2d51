"""Whether two pictures show the same, and if not, why: on NumPy and Pillow alone."""

from renderer.comparison.comparing import Comparison, compare
from renderer.comparison.errors import NotComparableError
from renderer.comparison.inputs import Picture, picture_of, read_picture
from renderer.comparison.verdicts import Policy

__all__ = [
    "Comparison",
    "NotComparableError",
    "Picture",
    "Policy",
    "compare",
    "picture_of",
    "read_picture",
]
