"""Reading Wavefront OBJ files: polygons with their vertices, materials and lines.

Source: the Wavefront OBJ format, appendix B1 of the Advanced Visualizer manual.
"""

import re
from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from renderer.assets import AssetError
from renderer.math.arrays import Floats, Integers, Masks
from renderer.meshes.triangulation import DEFAULT_COORDINATES, triangulate
from renderer.meshes.wavefront import name_in, statements
from schemas.quantities import MAX_COORDINATE

if TYPE_CHECKING:
    from collections.abc import Callable

MISSING = -1
"""Stands for missing texture coordinates, normals or materials."""

_COMPONENTS = {"v": 3, "vt": 2, "vn": 3}
"""Numbers of each kind, in the order in which corners name them."""
_THINGS = {"v": "vertex", "vt": "texture coordinate", "vn": "normal"}
_CORNER = re.compile(rb"[-+]?\d{1,18}(?:/(?:[-+]?\d{1,18})?){0,2}")
_LEFT_OUT = np.iinfo(np.int64).min
"""Stands for a number that a corner leaves out, while those of others may be negative."""
_WORDS_AT_ONCE = 1 << 16
"""Words that become numbers at once: a file has millions."""
_LONGEST_SHOWN = 60
"""Characters of a word in a message."""
_AGAIN = "Correct the line, or export the mesh again."


class ObjError(AssetError):
    """A line of an OBJ file cannot be used.

    Parameters
    ----------
    name
        The file, as the scene names it.
    line
        The line, from 1.
    detail
        The problem and its cure.
    """

    def __init__(self, name: str, line: int, detail: str) -> None:
        super().__init__(f"{name}:{line}: {detail}")
        self.line = line
        self.detail = detail


@dataclass(frozen=True, slots=True, eq=False)
class ObjFile:
    """The polygons of a file.

    Attributes
    ----------
    vertices : (V, 3) float64
    texture : (U, 2) float64
    normals : (N, 3) float64
    corners : (C, 3) int64
        Numbers of the vertex, the texture coordinates and the normal of each corner, from 0; the last two may
        be `MISSING`.
    sizes : (F,) int64
        Corners of each face, at least 3; faces are in the order of the file.
    lines : (F,) int64
        The line of each face, from 1.
    materials : (F,) int64
        The material of each face by its position in `used`; `MISSING` before the first.
    used
        Names of materials, and the lines that use them first.
    libraries
        Names of MTL files, and the lines that name them.
    left_out
        Statements that are not read, and the lines of all of a kind; `v` where vertices have colours.
    """

    vertices: Floats
    texture: Floats
    normals: Floats
    corners: Integers
    sizes: Integers
    lines: Integers
    materials: Integers
    used: dict[str, int]
    libraries: list[tuple[str, int]]
    left_out: dict[str, Integers]

    @property
    def triangle_count(self) -> int:
        """Triangles into which the faces are cut."""
        return int(self.sizes.sum()) - 2 * len(self.sizes)


def read_obj(name: str, content: bytes) -> ObjFile:
    """Read an OBJ file.

    Parameters
    ----------
    name
        The file, for messages.
    content
        Its bytes.

    Raises
    ------
    ObjError
        A line is malformed.
    AssetError
        The file has no faces.
    """
    reader = _Reader(name)
    take, leave_out = reader.takers, reader.leave_out
    for line, text in statements(content):
        words = text.split()
        take.get(words[0], leave_out)(line, words, text)
    return reader.finish()


def cut_into_triangles(obj: ObjFile) -> tuple[Floats, Integers, Floats | None]:
    """Vertices (3, V), triangles (3, T) and texture coordinates (2, V), or None if no face has any.

    A face of which a corner has none has none at all: each of its triangles gets `DEFAULT_COORDINATES`.
    """
    triangles, faces = triangulate(obj.vertices[obj.corners[:, 0]], obj.sizes)
    vertex, texture, _ = obj.corners.T
    bare = ~has_all(obj, texture)[faces]
    if bare.all():
        return obj.vertices.T.copy(), vertex[triangles].T.copy(), None
    # On a seam of the texture, a vertex becomes one for each of its texture coordinates.
    pairs = (vertex * len(obj.texture) + texture)[triangles[~bare]]
    known, inverse = np.unique(pairs, return_inverse=True)
    rows = np.empty_like(triangles)
    rows[~bare] = inverse.reshape(-1, 3)
    rows[bare] = len(known) + np.arange(3 * bare.sum()).reshape(-1, 3)
    numbers, coordinates = np.divmod(known, len(obj.texture))
    vertices = obj.vertices[np.concatenate([numbers, vertex[triangles[bare]].ravel()])]
    uv = np.concatenate([obj.texture[coordinates], np.tile(DEFAULT_COORDINATES, (bare.sum(), 1))])
    return vertices.T.copy(), rows.T.copy(), uv.T.copy()


def has_all(obj: ObjFile, numbers: Integers) -> Masks:
    """Faces (F,) of which every corner has a number, given one column of `corners`."""
    return np.logical_and.reduceat(numbers != MISSING, np.cumsum(obj.sizes) - obj.sizes)


class _Coordinates:
    """Statements of one kind. Many words become numbers at once, which is several times as fast."""

    def __init__(self, name: str, keyword: str) -> None:
        self.name = name
        self.keyword = keyword
        self.count = _COMPONENTS[keyword]
        self.lines = array("q")
        self.longer = array("q")
        self.words: list[bytes] = []
        self.numbers: list[Floats] = []

    def take(self, line: int, words: list[bytes], _text: bytes) -> None:
        if len(words) != self.count + 1:
            words = self._as_many(line, words)
        self.words += words[1:]
        self.lines.append(line)
        if len(self.words) > _WORDS_AT_ONCE:
            self._convert()

    def _as_many(self, line: int, words: list[bytes]) -> list[bytes]:
        """The statement with as many numbers as are read; the second texture coordinate may be missing."""
        given = len(words) - 1
        if given == 1 and self.keyword == "vt":
            return [*words, b"0"]
        odd = next((word for word in words[1:] if not _is_number(word)), None)
        if given < self.count or odd is not None:
            raise self._no_numbers(line, f"only {given}" if odd is None else _shown(odd))
        if given > self.count + 1:
            self.longer.append(line)
        return words[: self.count + 1]

    def _convert(self) -> None:
        try:
            numbers = np.fromiter(map(float, self.words), np.float64, len(self.words))
        except ValueError:
            numbers = np.array([np.nan])
        # Python reads 1_0 as 10.
        if not (np.abs(numbers) <= MAX_COORDINATE).all() or b"_" in b"".join(self.words):
            place = next(place for place, word in enumerate(self.words) if not _is_number(word))
            line = self.lines[(sum(map(len, self.numbers)) + place) // self.count]
            raise self._no_numbers(line, _shown(self.words[place]))
        self.numbers.append(numbers)
        self.words.clear()

    def _no_numbers(self, line: int, given: str) -> ObjError:
        detail = (
            f"'{self.keyword}' needs {self.count} numbers, none larger than {MAX_COORDINATE:g}, "
            f"but has {given}."
        )
        return ObjError(self.name, line, f"{detail} {_AGAIN}")

    def finish(self) -> Floats:
        """All of them, (N, 3) or (N, 2)."""
        self._convert()
        return np.concatenate(self.numbers).reshape(-1, self.count)


class _Faces:
    """Faces, of which many become numbers at once."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.sizes, self.lines = array("q"), array("q")
        self.words: list[bytes] = []
        self.corners: list[Integers] = []

    def take(self, line: int, words: list[bytes], _text: bytes) -> None:
        if len(words) < 4:
            detail = "A face has at least three corners. Add some, or remove the line."
            raise ObjError(self.name, line, detail)
        self.words += words[1:]
        self.sizes.append(len(words) - 1)
        self.lines.append(line)
        if len(self.words) > _WORDS_AT_ONCE:
            self._convert()

    def _convert(self) -> None:
        try:
            self.corners.append(_corners(self.words))
        except (ValueError, IndexError, OverflowError):
            place = next(place for place, word in enumerate(self.words) if not _CORNER.fullmatch(word))
            line = self._line_of(sum(map(len, self.corners)) + place)
            detail = f"{_shown(self.words[place])} is no corner of a face. Write v, v/vt, v//vn or v/vt/vn."
            raise ObjError(self.name, line, detail) from None
        self.words.clear()

    def _line_of(self, corner: int) -> int:
        return self.lines[int(np.searchsorted(np.cumsum(self.sizes), corner, side="right"))]

    def finish(self, coordinates: list[_Coordinates]) -> Integers:
        """All corners (C, 3) as numbers from 0.

        They may name what comes after them. Negative numbers count backwards from the last one before them.
        """
        self._convert()
        corners = np.concatenate(self.corners)
        for column, kind in zip(corners.T, coordinates, strict=True):
            column[:] = self._from_zero(column, kind)
        return corners

    def _from_zero(self, given: Integers, kind: _Coordinates) -> Integers:
        numbers, count, there = given.copy(), len(kind.lines), given != _LEFT_OUT
        backwards = there & (given < 0)
        if backwards.any():
            lines = np.repeat(self.lines, self.sizes)[backwards]
            numbers[backwards] += 1 + np.searchsorted(kind.lines, lines)
        wrong = there & ((given == 0) | (numbers < 1) | (numbers > count))
        if wrong.any():
            corner = int(wrong.argmax())
            where = f"{count} in the file" if given[corner] >= 0 else "those before this line"
            detail = f"There is no {_THINGS[kind.keyword]} {given[corner]} among {where}; they count from 1. "
            raise ObjError(self.name, self._line_of(corner), detail + _AGAIN)
        return np.where(there, numbers - 1, MISSING)


def _corners(words: list[bytes]) -> Integers:
    """Numbers (C, 3) of corners as they are written, `_LEFT_OUT` where one is left out.

    Raises ValueError, IndexError or OverflowError if a word is not a corner.
    """
    text = b" ".join(words)
    corners = np.full((len(words), len(_COMPONENTS)), _LEFT_OUT)
    if b"/" not in text:
        corners[:, 0] = _whole_numbers(text)
        return corners
    characters = np.frombuffer(text + b" ", np.uint8)
    ends = np.flatnonzero((characters == ord("/")) | (characters == ord(" ")))
    is_last = characters[ends] == ord(" ")
    word = np.cumsum(is_last) - is_last
    part = np.arange(len(ends)) - np.flatnonzero(np.concatenate([[True], is_last[:-1]]))[word]
    filled = np.diff(ends, prepend=-1) > 1
    corners[word[filled], part[filled]] = _whole_numbers(text.replace(b"/", b" "))
    if part.max() >= len(_COMPONENTS) or (corners[:, 0] == _LEFT_OUT).any():
        raise ValueError
    return corners


def _whole_numbers(text: bytes) -> Integers:
    if not text.translate(None, b"0123456789 "):
        return np.fromstring(text.decode(), np.int64, sep=" ")
    # Python reads 1_0 as 10.
    words = text.replace(b"_", b"?").split()
    return np.fromiter(map(int, words), np.int64, len(words))


def _is_number(word: bytes) -> bool:
    try:
        return abs(float(word)) <= MAX_COORDINATE and b"_" not in word
    except ValueError:
        return False


def _shown(word: bytes) -> str:
    return repr(word.decode("latin-1")[:_LONGEST_SHOWN])


class _Reader:
    """State of the reader; one method per kind of statement, called with its line, words and text."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.coordinates = [_Coordinates(name, keyword) for keyword in _COMPONENTS]
        self.faces = _Faces(name)
        self.used: dict[str, int] = {}
        self.changes: list[tuple[int, str]] = [(0, "")]
        self.libraries: list[tuple[str, int]] = []
        self.left_out: dict[str, array[int]] = {}
        self.takers: dict[bytes, Callable[[int, list[bytes], bytes], None]] = {
            **{kind.keyword.encode(): kind.take for kind in self.coordinates},
            b"f": self.faces.take,
            b"usemtl": self._use,
            b"mtllib": self._name_library,
            # Groups and smoothing groups change no polygon.
            **dict.fromkeys((b"o", b"g", b"s"), lambda *_: None),
        }

    def leave_out(self, line: int, words: list[bytes], _text: bytes) -> None:
        self.left_out.setdefault(words[0].decode("latin-1"), array("q")).append(line)

    def _use(self, line: int, _words: list[bytes], text: bytes) -> None:
        name = name_in(text)
        self.changes.append((len(self.faces.sizes), name))
        if name:
            self.used.setdefault(name, line)

    def _name_library(self, line: int, _words: list[bytes], text: bytes) -> None:
        self.libraries.append((name_in(text), line))

    def finish(self) -> ObjFile:
        """The file, after its numbers have been checked together."""
        if not self.faces.sizes:
            raise AssetError(f"{self.name}: The mesh has no triangles: the file has no faces ('f').")
        vertices, texture, normals = (kind.finish() for kind in self.coordinates)
        self.left_out["v"] = self.coordinates[0].longer
        return ObjFile(
            vertices=vertices,
            texture=texture,
            normals=normals,
            corners=self.faces.finish(self.coordinates),
            sizes=np.array(self.faces.sizes),
            lines=np.array(self.faces.lines),
            materials=self._materials(),
            used=self.used,
            libraries=self.libraries,
            left_out={keyword: np.array(lines) for keyword, lines in self.left_out.items() if lines},
        )

    def _materials(self) -> Integers:
        positions = {name: place for place, name in enumerate(self.used)}
        starts = [start for start, _ in self.changes]
        numbers = [positions.get(name, MISSING) for _, name in self.changes]
        return np.repeat(numbers, np.diff([*starts, len(self.faces.sizes)]))
