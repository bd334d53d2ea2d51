"""The rows of a PLY file's elements, as arrays.

A text of numbers is read into float64 at once, and from then on is a binary file like any other, in which
every number, and every count, has eight bytes.
"""

import struct
import warnings
from array import array
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.assets import AssetError, changed_filters
from renderer.math.arrays import Integers
from renderer.meshes.ply_header import Element, Header, Property
from schemas.limits import how_to_raise

_STRUCTS = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f8": "d"}
_AT_MOST = 8
"""Numbers of lists for each triangle that is allowed; a strip of one triangle needs four, a face six."""
_LONGEST_SHOWN = 40
"""Characters of a word in a message."""


@dataclass(frozen=True, slots=True, eq=False)
class Lists:
    """One list of each row.

    Attributes
    ----------
    sizes : (R,) int64
    values : (N,)
        All of them, row after row.
    """

    sizes: Integers
    values: NDArray[Any]


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Some columns of an element.

    Attributes
    ----------
    numbers
        Columns of single numbers (R,), by name.
    lists
        Columns of lists, by name.
    offsets
        Offset of each row in the numbers of the file, bytes.
    end
        Offset of the end.
    """

    numbers: Mapping[str, NDArray[Any]]
    lists: Mapping[str, Lists]
    offsets: Sequence[int]
    end: int


class Body:
    """Body of a PLY file: the elements after its header.

    Parameters
    ----------
    content
        The whole file.
    header
        Its header.
    most
        Most triangles that it may have.
    """

    def __init__(self, content: bytes, header: Header, most: int) -> None:
        self.header = header
        self.most = most
        self.text = b"" if header.order else content[header.start :]
        self.content: bytes | memoryview = content
        self.start = header.start
        if not header.order:
            self.content, self.start = self._numbers().view(np.uint8).data, 0

    def _numbers(self) -> NDArray[np.float64]:
        try:
            with changed_filters():
                # NumPy reports by this that a word is no number.
                warnings.filterwarnings(
                    "error", "string or file could not be read", category=DeprecationWarning
                )
                return np.fromstring(self.text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            for line, words in enumerate(self.text.splitlines(), self.header.lines + 1):
                for word in words.split():
                    _check_number(word, line)
            raise AssetError("The mesh cannot be read as PLY: it is damaged. Save it again.") from error

    def read(self, wanted: Mapping[str, Collection[str]]) -> dict[str, Rows]:
        """Columns of some elements.

        Parameters
        ----------
        wanted
            Names of columns by those of elements. What the file does not have is left out.

        Raises
        ------
        AssetError
            The file ends too early, or has more numbers than are allowed.
        """
        found: dict[str, Rows] = {}
        here = self.start
        last = max((i for i, each in enumerate(self.header.elements) if each.name in wanted), default=-1)
        for element in self.header.elements[: last + 1]:
            if not self.header.order:
                element = _as_text(element)  # noqa: PLW2901
            rows = self._element(element, here, wanted.get(element.name, ()))
            found[element.name], here = rows, rows.end
        return found

    def _element(self, element: Element, here: int, wanted: Collection[str]) -> Rows:
        kind = self._alike(element, here)
        if kind is None:
            return self._one_by_one(element, here, wanted)
        end = here + element.count * kind.itemsize
        # A row may have no columns, and a column no numbers.
        rows = (
            np.ndarray(element.count, kind, self.content, here)
            if end > here
            else np.empty(element.count, kind)
        )
        named = [(each, f"{place}") for place, each in enumerate(element.properties) if each.name in wanted]
        lists = {each.name: rows[name] for each, name in named if each.counted}
        for values in lists.values():
            self._refuse_many(values.size)
        return Rows(
            {each.name: rows[name] for each, name in named if not each.counted},
            {
                name: Lists(np.full(len(values), values.shape[1]), values.reshape(-1))
                for name, values in lists.items()
            },
            range(here, end, kind.itemsize) if end > here else (),
            end,
        )

    def _alike(self, element: Element, here: int) -> np.dtype[Any] | None:
        """The type of all rows; None if their lists have different lengths, or the file ends before."""
        fields: list[Any] = []
        for place, each in enumerate(element.properties):
            code = self.header.order + each.code
            if not each.counted:
                fields.append((f"{place}", code))
                continue
            fields.append((f"{place} size", self.header.order + each.counted))
            kind = np.dtype(fields)
            if here + kind.itemsize > len(self.content) or not element.count:
                return None
            size = float(np.ndarray(1, kind, self.content, here)[f"{place} size"][0])
            if not (0 <= size * np.dtype(code).itemsize <= len(self.content) and size.is_integer()):
                return None
            fields.append((f"{place}", code, (int(size),)))
        kind = np.dtype(fields)
        if here + element.count * kind.itemsize > len(self.content):
            return None
        if kind.itemsize == 0:
            return kind
        rows = np.ndarray(element.count, kind, self.content, here)
        sizes = [name for name in kind.names or () if name.endswith("size")]
        return kind if all((rows[name] == rows[name][0]).all() for name in sizes) else None

    def _one_by_one(self, element: Element, here: int, wanted: Collection[str]) -> Rows:
        chased = {each.name: (array("q"), array("q")) for each in element.properties if each.name in wanted}
        steps, skipped = [], 0
        for each in element.properties:
            if each.counted or each.name in wanted:
                size = np.dtype(each.code).itemsize
                steps.append((skipped, *self._counter(each), size, chased.get(each.name)))
                skipped = 0
            else:
                skipped += np.dtype(each.code).itemsize
        offsets, end = array("q"), len(self.content)
        for row in range(element.count):
            offsets.append(here)
            for skip, counter, width, size, found in steps:
                here += skip
                count = self._counted(counter, here, element, row) if counter else 1
                here += width
                if found is not None:
                    found[0].append(here)
                    found[1].append(count)
                here += count * size
            here += skipped
            if here > end:
                raise self._ends(element, row)
        return self._gathered(element, chased, offsets, here)

    def _counter(self, each: Property) -> tuple[struct.Struct | None, int]:
        if not each.counted:
            return None, 0
        counter = struct.Struct((self.header.order or "=") + _STRUCTS[each.counted])
        return counter, counter.size

    def _counted(self, counter: struct.Struct, here: int, element: Element, row: int) -> int:
        if here + counter.size > len(self.content):
            raise self._ends(element, row)
        (count,) = counter.unpack_from(self.content, here)
        if not (0 <= count < len(self.content) and count == int(count)):
            if count >= len(self.content):
                raise self._ends(element, row)
            raise AssetError(
                f"{self.named(element.name, row, here)} of the mesh has a list of {count} numbers. "
                "Save the mesh again."
            )
        return int(count)

    def _ends(self, element: Element, row: int) -> AssetError:
        return AssetError(
            f"The mesh ends within row {row + 1} of the {element.count} of its element {element.name!r}: it "
            "is cut short, or its header is wrong. Save it again."
        )

    def _gathered(
        self, element: Element, chased: dict[str, tuple[Any, Any]], offsets: Sequence[int], end: int
    ) -> Rows:
        numbers: dict[str, NDArray[Any]] = {}
        lists: dict[str, Lists] = {}
        content = np.frombuffer(self.content, dtype=np.uint8)
        for each in element.properties:
            if each.name in chased:
                starts, sizes = (np.array(some, dtype=np.int64) for some in chased[each.name])
                self._refuse_many(int(sizes.sum()))
                kind = np.dtype(self.header.order + each.code)
                first = np.repeat(starts - (np.cumsum(sizes) - sizes) * kind.itemsize, sizes)
                first += np.arange(len(first)) * kind.itemsize
                values = content[first[:, None] + np.arange(kind.itemsize)].view(kind).reshape(-1)
                if each.counted:
                    lists[each.name] = Lists(sizes, values)
                else:
                    numbers[each.name] = values
        return Rows(numbers, lists, offsets, end)

    def _refuse_many(self, count: int) -> None:
        if count > _AT_MOST * self.most:
            raise AssetError(
                f"The lists of the mesh have {count} numbers, more than its {self.most} triangles allowed "
                f"need. Simplify it. {how_to_raise('max_mesh_triangles')}"
            )

    def named(self, thing: str, number: int, place: int) -> str:
        """A row for people: its number, and its line where the file has lines."""
        name = f"{thing.capitalize()} {number} (counted from 0"
        if self.header.order:
            return f"{name})"
        return f"{name}, in line {self._line(place // 8)})"

    def _line(self, word: int) -> int:
        """The line of a word, counted from 0."""
        before = 0
        for line, words in enumerate(self.text.splitlines(), self.header.lines + 1):
            before += len(words.split())
            if before > word:
                return line
        return self.header.lines + len(self.text.splitlines())


def _as_text(element: Element) -> Element:
    return replace(
        element,
        properties=tuple(
            replace(each, code="f8", counted="f8" if each.counted else "") for each in element.properties
        ),
    )


def _check_number(word: bytes, line: int) -> None:
    try:
        float(word)
    except ValueError:
        shown = word[:_LONGEST_SHOWN].decode("latin-1")
        raise AssetError(
            f"Line {line} of the mesh has {shown!r} where a number is expected. Correct it, or save the "
            "mesh again."
        ) from None
