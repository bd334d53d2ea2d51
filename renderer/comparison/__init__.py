"""Whether two pictures show the same, and if not, why: on NumPy and Pillow alone."""

from renderer.comparison.asserting import assert_render_close
from renderer.comparison.comparing import Comparison, compare
from renderer.comparison.errors import NotComparableError
from renderer.comparison.inputs import Picture, picture_of, read_picture
from renderer.comparison.verdicts import Policy

__all__ = [
    "Comparison",
    "NotComparableError",
    "Picture",
    "Policy",
    "assert_render_close",
    "compare",
    "picture_of",
    "read_picture",
]
