"""Comparison of two pictures: verdict, likely mistakes and regions, with NumPy and Pillow alone."""

from accuracy.comparison.asserting import assert_render_close
from accuracy.comparison.comparing import Comparison, compare
from accuracy.comparison.decoding import NotComparableError
from accuracy.comparison.inputs import Picture, picture_of, read_picture
from accuracy.comparison.judging import Policy

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
