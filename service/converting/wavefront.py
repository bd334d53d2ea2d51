"""Reading Wavefront files: faces of OBJ and materials of MTL, with the lines of both.

trimesh, through which the renderer reads meshes, knows no lines and no first use of a material. It accepts
faces of two corners and NaN, skips statements before the first material, and loses pictures with options.

Source: the Wavefront OBJ and MTL formats, appendices B1 and B2 of the Advanced Visualizer manual.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from schemas.quantities import BRIGHTEST, LARGEST
from service.converting.errors import ConversionError, wrong_at_line
from service.converting.task import Notes

Corner = tuple[int, int | None, int | None]
"""Numbers of a vertex, a texture coordinate and a normal, from 0."""

_NO_GEOMETRY = frozenset({"o", "g", "s"})


@dataclass(frozen=True, slots=True)
class Face:
    """A polygon.

    Attributes
    ----------
    corners
        At least three.
    material
        The name after the last `usemtl`; None before the first.
    line
        Its line, from 1.
    """

    corners: tuple[Corner, ...]
    material: str | None
    line: int


@dataclass(slots=True)
class ObjText:
    """What a file says.

    Attributes
    ----------
    vertices, texture, normals
        Their coordinates: three, two and three numbers each.
    faces
        In the order of the file.
    libraries
        Names of MTL files and the lines that name them.
    used
        Materials and the lines that use them first.
    """

    vertices: list[tuple[float, ...]] = field(default_factory=list)
    texture: list[tuple[float, ...]] = field(default_factory=list)
    normals: list[tuple[float, ...]] = field(default_factory=list)
    faces: list[Face] = field(default_factory=list)
    libraries: list[tuple[str, int]] = field(default_factory=list)
    used: dict[str, int] = field(default_factory=dict)


def read_obj(name: str, content: bytes, notes: Notes) -> ObjText:
    """Read an OBJ file.

    Parameters
    ----------
    name
        The file, for messages.
    notes
        Unknown statements are noted here.

    Raises
    ------
    ConversionError
        At the first malformed line, or if there is no face.
    """
    reader = _Reader(name, content, notes)
    for line, words in statements(content):
        reader.take(line, words)
    if not reader.read.faces:
        detail = "The file has no faces, so there is nothing to see. Save the mesh with its faces."
        raise wrong_at_line(name, content, 1, detail)
    return reader.read


def statements(content: bytes) -> Iterator[tuple[int, list[str]]]:
    """Line numbers from 1 and words of an OBJ or MTL file, without comments and empty lines.

    A backslash at the end of a line joins it to the next.
    """
    begun: list[str] = []
    first = 0
    for number, line in enumerate(content.decode("utf-8-sig", errors="replace").splitlines(), 1):
        text = line.split("#", 1)[0].rstrip()
        first = first if begun else number
        begun += text.removesuffix("\\").split()
        if begun and not text.endswith("\\"):
            yield first, begun
            begun = []
    if begun:
        yield first, begun


class _Reader:
    def __init__(self, name: str, content: bytes, notes: Notes) -> None:
        self.name = name
        self.content = content
        self.notes = notes
        self.read = ObjText()
        self.material: str | None = None
        self.statements: dict[str, Callable[[int, list[str]], None]] = {
            "v": self._vertex,
            "vt": self._texture,
            "vn": self._normal,
            "f": self._face,
            "usemtl": self._use,
            "mtllib": self._library,
        }

    def take(self, line: int, words: list[str]) -> None:
        """Read one statement."""
        statement = self.statements.get(words[0])
        if statement is not None:
            statement(line, words[1:])
        elif words[0] not in _NO_GEOMETRY:
            detail = f"Statements '{words[0]}' are left out: only triangles and polygons are read."
            self.notes.leave_out(words[0], detail, line=line, file=self.name)

    def _vertex(self, line: int, words: list[str]) -> None:
        self.read.vertices.append(self._numbers(line, "v", words, 3))
        if len(words) > 4:
            detail = "Vertex colours are left out: a colour belongs to a material."
            self.notes.leave_out("v", detail, line=line, file=self.name)

    def _texture(self, line: int, words: list[str]) -> None:
        # One coordinate is allowed: the second is 0 then.
        self.read.texture.append(self._numbers(line, "vt", [*words, "0"] if len(words) == 1 else words, 2))

    def _normal(self, line: int, words: list[str]) -> None:
        self.read.normals.append(self._numbers(line, "vn", words, 3))

    def _numbers(self, line: int, statement: str, words: list[str], count: int) -> tuple[float, ...]:
        try:
            numbers = tuple(float(word) for word in words[:count])
        except ValueError:
            numbers = ()
        if len(numbers) < count or not all(abs(number) <= LARGEST for number in numbers):
            raise self._wrong(line, f"'{statement}' needs {count} numbers, none larger than {LARGEST:g}.")
        return numbers

    def _face(self, line: int, words: list[str]) -> None:
        if len(words) < 3:
            raise self._wrong(line, "A face has at least three corners. Add some, or remove the line.")
        corners = tuple(self._corner(line, word) for word in words)
        self.read.faces.append(Face(corners, self.material, line))

    def _corner(self, line: int, word: str) -> Corner:
        parts = [*word.split("/"), "", ""][:3]
        lists = (("vertices", self.read.vertices), ("texture coordinates", self.read.texture))
        (vertex, texture) = (
            self._index(line, part, what, len(items))
            for part, (what, items) in zip(parts, lists, strict=False)
        )
        if vertex is None:
            raise self._wrong(line, f"The corner {word!r} names no vertex. Write v, v/vt, v//vn or v/vt/vn.")
        return vertex, texture, self._index(line, parts[2], "normals", len(self.read.normals))

    def _index(self, line: int, part: str, what: str, count: int) -> int | None:
        if not part:
            return None
        try:
            number = int(part)
        except ValueError:
            number = 0
        # Numbers below 0 count backwards from the last one so far.
        index = number + count if number < 0 else number - 1
        if number == 0 or not 0 <= index < count:
            detail = (
                f"There is no number {part} among the {count} {what} before this line; they count from 1."
            )
            raise self._wrong(line, detail)
        return index

    def _use(self, line: int, words: list[str]) -> None:
        self.material = " ".join(words) or None
        if self.material is not None:
            self.read.used.setdefault(self.material, line)

    def _library(self, line: int, words: list[str]) -> None:
        names = [" ".join(words)] if sum(word.lower().endswith(".mtl") for word in words) < 2 else words
        self.read.libraries += [(name, line) for name in names if name]

    def _wrong(self, line: int, detail: str) -> ConversionError:
        return wrong_at_line(self.name, self.content, line, detail)


_ARGUMENTS = {
    "-blendu": 1,
    "-blendv": 1,
    "-bm": 1,
    "-boost": 1,
    "-cc": 1,
    "-clamp": 1,
    "-imfchan": 1,
    "-mm": 2,
    "-o": 3,
    "-s": 3,
    "-t": 3,
    "-texres": 1,
    "-type": 1,
}
"""Options of maps, and the most words that follow each."""

_NUMBERS_ALONE = frozenset({"-o", "-s", "-t"})
"""Options with one to three numbers."""


@dataclass(frozen=True, slots=True)
class Statement:
    """A line of a material."""

    words: tuple[str, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Map:
    """A picture that a statement names.

    Attributes
    ----------
    name
        The file.
    options
        Words after each option.
    line
        Its line.
    """

    name: str
    options: dict[str, tuple[str, ...]]
    line: int


@dataclass(slots=True)
class MtlMaterial:
    """One material: its statements by keyword, in lower case; the last of each kind counts."""

    name: str
    file: str
    content: bytes
    line: int
    statements: dict[str, Statement] = field(default_factory=dict)

    def numbers(self, keyword: str, count: int) -> tuple[float, ...] | None:
        """Numbers of a statement; None if there are none. One number may stand for three equal ones.

        Raises
        ------
        ConversionError
            It has others, or a number below 0.
        """
        statement = self.statements.get(keyword)
        if statement is None:
            return None
        words = statement.words * count if len(statement.words) == 1 else statement.words
        try:
            numbers = tuple(float(word) for word in words)
        except ValueError:
            numbers = ()
        if len(numbers) != count or not all(0 <= number <= BRIGHTEST for number in numbers):
            detail = f"'{keyword}' needs {count} number{'s' if count > 1 else ''} of 0 or more."
            raise wrong_at_line(self.file, self.content, statement.line, detail)
        return numbers

    def map(self, keyword: str) -> Map | None:
        """The picture of a statement; None if there is none."""
        statement = self.statements.get(keyword)
        if statement is None:
            return None
        words = list(statement.words)
        options: dict[str, tuple[str, ...]] = {}
        while words and words[0].lower() in _ARGUMENTS:
            option = words.pop(0).lower()
            count = _argument_count(option, words)
            options[option] = tuple(words[:count])
            del words[:count]
        if not words:
            detail = f"'{keyword}' needs the name of a picture."
            raise wrong_at_line(self.file, self.content, statement.line, detail)
        return Map(" ".join(words), options, statement.line)


def _argument_count(option: str, words: list[str]) -> int:
    most = _ARGUMENTS[option]
    if option not in _NUMBERS_ALONE:
        return most
    return next((place for place, word in enumerate(words[:most]) if not _is_number(word)), most)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def read_mtl(name: str, content: bytes) -> dict[str, MtlMaterial]:
    """Materials of a file by name.

    Raises
    ------
    ConversionError
        A statement comes before the first material, or a material has no name.
    """
    materials: dict[str, MtlMaterial] = {}
    current: MtlMaterial | None = None
    for line, (keyword, *words) in statements(content):
        if keyword.lower() == "newmtl":
            if not words:
                raise wrong_at_line(name, content, line, "'newmtl' needs the name of the material.")
            current = MtlMaterial(" ".join(words), name, content, line)
            materials[current.name] = current
        elif current is None:
            detail = f"'{keyword}' comes before the first 'newmtl', so it belongs to no material."
            raise wrong_at_line(name, content, line, detail)
        else:
            current.statements[keyword.lower()] = Statement(tuple(words), line)
    return materials
