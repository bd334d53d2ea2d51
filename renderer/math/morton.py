"""Morton's order: cells of a grid numbered so that any stretch of numbers is compact."""

from renderer.math.arrays import Integers


def codes(columns: Integers, rows: Integers) -> Integers:
    """Numbers (N,) of cells: the bits of columns and rows (N,) interleaved, those of columns lowest.

    The lower 16 bits of each count.
    """
    return _spread(columns) | _spread(rows) << 1


def _spread(numbers: Integers) -> Integers:
    """The lower 16 bits of numbers at every other place."""
    numbers = numbers & 0xFFFF
    for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        numbers = (numbers | numbers << shift) & mask
    return numbers
