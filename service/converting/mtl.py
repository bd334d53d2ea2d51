"""Reading MTL files: statements of materials, with their lines.

Source: the Wavefront MTL format, appendix B2 of the Advanced Visualizer manual.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from renderer.meshes.wavefront import name_in, statements
from service.converting.task import Notes

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
    """A line of a material: what follows its keyword."""

    text: str
    line: int


@dataclass(frozen=True, slots=True)
class Map:
    """A picture that a statement names.

    Attributes
    ----------
    name
        The file; empty if there is none.
    options
        Words after each option.
    """

    name: str
    options: dict[str, tuple[str, ...]]


@dataclass(slots=True)
class MtlMaterial:
    """One material: its statements by keyword, in lower case; the last of each kind counts."""

    name: str
    file: str
    line: int
    statements: dict[str, Statement] = field(default_factory=dict)

    def map(self, keyword: str) -> Map | None:
        """The picture of a statement; None if there is none of that keyword."""
        statement = self.statements.get(keyword)
        return None if statement is None else _map(statement.text)


def _map(text: str) -> Map:
    options: dict[str, tuple[str, ...]] = {}
    words = text.split()
    while words and words[0].lower() in _ARGUMENTS:
        option = words[0].lower()
        count = _argument_count(option, words[1:])
        options[option] = tuple(words[1 : 1 + count])
        # The name keeps its own spaces.
        text = "".join(text.split(None, 1 + count)[1 + count :])
        words = text.split()
    return Map(text, options)


def _argument_count(option: str, words: list[str]) -> int:
    most = _ARGUMENTS[option]
    if option in _NUMBERS_ALONE:
        most = next((place for place, word in enumerate(words[:most]) if number_in(word) is None), most)
    return min(most, len(words))


def number_in(word: str) -> float | None:
    """A word as a number; None if it is not one."""
    try:
        return float(word)
    except ValueError:
        return None


def without_comment(name: str) -> str:
    """A name up to a '#' after a space: many programs write such names, and a few such comments.

    >>> without_comment("oak #2")
    'oak'
    """
    return name.split(" #", 1)[0].rstrip()


def read_mtl(name: str, content: bytes, notes: Notes) -> list[MtlMaterial]:
    """Materials of a file, in its order. Statements outside of a material and repeated names are noted."""
    materials: dict[str, MtlMaterial] = {}
    current: MtlMaterial | None = None
    for line, text in statements(content):
        keyword, rest = text.split()[0].decode("latin-1"), name_in(text)
        if keyword.lower() == "newmtl":
            current = MtlMaterial(rest, name, line) if rest else None
            _note(notes, name, line, known=rest in materials, named=bool(rest))
            if current is not None:
                materials[rest] = current
        elif current is None:
            detail = "It belongs to no material: it comes before the first 'newmtl' that has a name."
            notes.leave_out(keyword, detail, line=line, file=name)
        else:
            current.statements[keyword.lower()] = Statement(rest, line)
    return list(materials.values())


def _note(notes: Notes, name: str, line: int, *, known: bool, named: bool) -> None:
    if not named:
        notes.leave_out("newmtl", "This material has no name, so no face can use it.", line=line, file=name)
    elif known:
        detail = "An earlier material of the same name is replaced by this one."
        notes.assume("newmtl", detail, line=line, file=name)
