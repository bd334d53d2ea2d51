"""Reading MTL files: the statements of each material, with their lines.

Source: the Wavefront MTL format, appendix B2 of the Advanced Visualizer manual.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from schemas.quantities import BRIGHTEST
from service.converting.errors import wrong_at_line
from service.converting.obj_text import statements

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
        Where it stands.
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
        """Numbers of a statement; None where there is none. One number may stand for three equal ones.

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
            detail = f"After '{keyword}' {count} number{'s' if count > 1 else ''} of 0 or more belong."
            raise wrong_at_line(self.file, self.content, statement.line, detail)
        return numbers

    def map(self, keyword: str) -> Map | None:
        """The picture of a statement; None where there is none."""
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
            detail = f"After '{keyword}' the name of a picture belongs."
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
        A statement stands before the first material, or a material has no name.
    """
    materials: dict[str, MtlMaterial] = {}
    current: MtlMaterial | None = None
    for line, (keyword, *words) in statements(content):
        if keyword.lower() == "newmtl":
            if not words:
                raise wrong_at_line(name, content, line, "After 'newmtl' the name of the material belongs.")
            current = MtlMaterial(" ".join(words), name, content, line)
            materials[current.name] = current
        elif current is None:
            detail = f"'{keyword}' stands before the first 'newmtl', so it belongs to no material."
            raise wrong_at_line(name, content, line, detail)
        else:
            current.statements[keyword.lower()] = Statement(tuple(words), line)
    return materials
