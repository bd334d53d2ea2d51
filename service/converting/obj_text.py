"""Reading OBJ files: faces, the materials they use, and the lines of both.

Source: the Wavefront OBJ format, appendix B1 of the Advanced Visualizer manual.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from schemas.quantities import LARGEST
from service.converting.assumptions import Notes
from service.converting.errors import ConversionError, wrong_at_line

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
        Where it stands, from 1.
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
        Statements that are not known are told there.

    Raises
    ------
    ConversionError
        At the first line that makes no sense, or if there is no face.
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

    A backslash at the end of a line goes on with the next.
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
            detail = f"Statements '{words[0]}' are left out: of OBJ files triangles and polygons are read."
            self.notes.leave_out(words[0], detail, line=line, file=self.name)

    def _vertex(self, line: int, words: list[str]) -> None:
        self.read.vertices.append(self._numbers(line, "v", words, 3))
        if len(words) > 4:
            detail = "Colours of vertices are left out: a colour belongs to a material."
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
            raise self._wrong(
                line, f"After '{statement}' {count} numbers belong, none of them beyond {LARGEST:g}."
            )
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
