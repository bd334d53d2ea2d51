"""The header of a PLY file: which elements there are, and how their numbers are stored.

Source: Greg Turk, The PLY Polygon File Format (1994), and the names of types that later programs write.
"""

import re
from dataclasses import dataclass

from renderer.assets import AssetError

_TYPES = {
    "i1": ("char", "int8"),
    "u1": ("uchar", "uint8"),
    "i2": ("short", "int16"),
    "u2": ("ushort", "uint16"),
    "i4": ("int", "int32"),
    "u4": ("uint", "uint32"),
    "f4": ("float", "float32"),
    "f8": ("double", "float64"),
}
_CODES = {name: code for code, names in _TYPES.items() for name in names}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_MAX_HEADER_BYTES = 1 << 16
"""Bytes in which a header ends: ordinary ones have a few hundred."""
_FIRST_LINE = re.compile(rb"ply[ \t]*(\r\n|\n|\r)")
_LONGEST_SHOWN = 60
"""Characters of a line in a message."""


@dataclass(frozen=True, slots=True)
class Property:
    """One number of each row, or one list.

    Attributes
    ----------
    name
    code
        Type of its numbers, as NumPy writes it.
    counted
        That of the count before each list; empty where it is no list.
    """

    name: str
    code: str
    counted: str


@dataclass(frozen=True, slots=True)
class Element:
    """A table of the file.

    Attributes
    ----------
    name
    count
        Its rows.
    properties
        Its columns, in the order of the file.
    """

    name: str
    count: int
    properties: tuple[Property, ...]


@dataclass(frozen=True, slots=True)
class Header:
    """Header of a PLY file.

    Attributes
    ----------
    order
        Of bytes, `<` or `>`; empty where numbers are text.
    elements
        In the order of the file.
    pictures
        Names of texture files in its comments.
    start
        Offset of its numbers, bytes.
    lines
        Lines before them.
    """

    order: str
    elements: tuple[Element, ...]
    pictures: tuple[str, ...]
    start: int
    lines: int

    @property
    def count(self) -> int:
        """Rows of the largest element whose rows are read one by one, or which holds the vertices."""
        read = (each for each in self.elements if each.name == "vertex" or _has_lists(each))
        return max((each.count for each in read), default=0)


def _has_lists(element: Element) -> bool:
    return any(each.counted for each in element.properties) or element.name == "face"


def header_of(content: bytes) -> Header:
    """Read the header of a PLY file.

    Raises
    ------
    AssetError
        It has no end, or a line that is not understood.
    """
    first = _FIRST_LINE.match(content)
    if first is None:
        raise AssetError("The mesh cannot be read as PLY: its first line has more than 'ply'. Save it again.")
    # A binary body may begin with the byte of a line's end.
    ending = re.compile(rb"%bend_header[ \t]*(?:%b|\Z)" % (first[1], first[1]))
    end = ending.search(content, first.end() - len(first[1]), _MAX_HEADER_BYTES)
    if end is None:
        raise AssetError(
            "The mesh cannot be read as PLY: no line 'end_header' ends its header. Save it again."
        )
    lines = content[first.end() : end.start()].decode("latin-1").split(first[1].decode())
    header = _Reader()
    for number, line in enumerate(lines, 2):
        header.read(number, line.strip())
    return header.finished(end.end(), len(lines) + 2)


class _Reader:
    """Takes the lines of a header one by one."""

    def __init__(self) -> None:
        self.order: str | None = None
        self.elements: list[tuple[str, int, list[Property]]] = []
        self.pictures: list[str] = []

    def read(self, number: int, line: str) -> None:
        words = line.split()
        try:
            match words:
                case [] | ["obj_info", *_]:
                    pass
                case ["comment", *_]:
                    self._comment(line)
                case ["format", kind, "1.0"]:
                    self.order = _ORDERS[kind]
                case ["element", name, count]:
                    self._element(name, count)
                case ["property", "list", counted, kind, name]:
                    self._list(name, _CODES[kind], _CODES[counted])
                case ["property", kind, name]:
                    self.elements[-1][2].append(Property(name, _CODES[kind], ""))
                case _:
                    raise ValueError
        except (LookupError, ValueError) as error:
            shown = line[:_LONGEST_SHOWN]
            raise AssetError(
                f"The mesh cannot be read as PLY: line {number} of its header is not understood: {shown!r}. "
                "Save it again."
            ) from error

    def _comment(self, line: str) -> None:
        words = line.split(None, 2)
        if len(words) == 3 and words[1].lower() == "texturefile":
            self.pictures.append(words[2])

    def _element(self, name: str, count: str) -> None:
        # A number of more digits is too large, and too long for Python to read.
        if not count.isascii() or not count.isdigit() or len(count) > 18:
            raise ValueError
        if any(known == name for known, *_ in self.elements):
            raise ValueError
        self.elements.append((name, int(count), []))

    def _list(self, name: str, code: str, counted: str) -> None:
        if counted.startswith("f"):
            raise ValueError
        self.elements[-1][2].append(Property(name, code, counted))

    def finished(self, start: int, lines: int) -> Header:
        if self.order is None:
            known = ", ".join(_ORDERS)
            raise AssetError(
                f"The mesh cannot be read as PLY: its header has no 'format'. Known ones are {known}."
            )
        elements = tuple(Element(name, count, tuple(some)) for name, count, some in self.elements)
        return Header(self.order, elements, tuple(self.pictures), start, lines)
