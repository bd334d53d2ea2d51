"""Convert MTL materials to Phong materials of a scene."""

from __future__ import annotations

from pathlib import Path, PurePath
from typing import Any

from schemas.quantities import MAX_COORDINATE, MAX_INTENSITY
from service.converting.errors import FileAwayError
from service.converting.mtl import Map, MtlMaterial, number_in, without_comment
from service.converting.surroundings import DEFAULT_GREY
from service.converting.task import UNUSABLE_FILE_ERRORS, Task, named_texture, picture_file

MAX_SHININESS = 1e15
"""Largest shininess of a scene."""
BUMP_SHARE = 0.01
"""Height of a bump map's white with -bm 1, as a share of the mesh's diagonal: MTL files name no unit."""

MIRRORS = frozenset({3, 5})
GLASSES = frozenset({4, 6, 7, 9})
"""Illumination models of the format: 3 and 5 reflect, 4, 6, 7 and 9 are glass."""
NO_HIGHLIGHT = frozenset({0, 1})

LINEAR_LIGHT = (".exr", ".hdr", ".rgbe", ".pfm")
"""Endings of pictures that store linear light, for any use."""

COLOR_MAP = ("map_kd",)
BUMP_MAPS = ("map_bump", "bump")
NORMAL_MAPS = ("norm", "map_kn")
_CONVERTED = frozenset(
    {"kd", "ks", "ns", "kr", "ni", "d", "tr", "illum", *COLOR_MAP, *BUMP_MAPS, *NORMAL_MAPS}
)


_REASONS = {
    "ka": "Ka is left out: each material reflects 0.1 of the scene's ambient light, times its colour.",
    "ke": "Ke is left out: shapes emit no light. Put a light in their place.",
    "disp": "Displacement is left out, as the format names no unit: add displacement_map and "
    "displacement_height to the material.",
}


class MtlConverter:
    """Turns MTL materials into those of one scene.

    Parameters
    ----------
    task
        The OBJ file.
    folder
        That of the MTL file, from which its pictures are named.
    diagonal
        Length of the mesh's bounding box, scene units.
    textures
        The scene's textures; they are added here.
    """

    def __init__(self, task: Task, folder: Path, diagonal: float, textures: dict[str, Any]) -> None:
        self.task = task
        self.folder = folder
        self.diagonal = diagonal
        self.textures = textures

    def convert(self, written: MtlMaterial) -> dict[str, Any]:
        """One material; lines that cannot be used are noted and left out."""
        model = int(self._number(written, "illum", 2))
        made: dict[str, Any] = {"type": "phong"}
        self._color(written, made)
        self._highlight(written, made, model)
        self._bounces(written, made, model)
        self._relief(written, made)
        self._others(written)
        return made

    def _color(self, written: MtlMaterial, made: dict[str, Any]) -> None:
        color = self._numbers(written, "kd", 3)
        texture = self._texture(written, COLOR_MAP, "srgb")
        if texture is None:
            made["color"] = list(color or (DEFAULT_GREY,) * 3)
            if color is None:
                self._assume(written, "Kd", f"Without Kd, the material is grey, {DEFAULT_GREY}.")
            return
        made["color_texture"] = texture
        if color is not None and color != (1, 1, 1):
            made["diffuse"] = sum(color) / 3
            if len(set(color)) > 1:
                detail = (
                    "The texture is multiplied by the mean of Kd: one factor for all colours is possible."
                )
                self._assume(written, "Kd", detail)

    def _highlight(self, written: MtlMaterial, made: dict[str, Any], model: int) -> None:
        color = self._numbers(written, "ks", 3) or (0.0,)
        sharpness = self._number(written, "ns", 20)
        if model in NO_HIGHLIGHT or not any(color):
            return
        made["specular"] = sum(color) / len(color)
        made["shininess"] = min(sharpness, MAX_SHININESS)
        if len(set(color)) > 1:
            detail = "The highlight has the mean of Ks: it is as white as the light."
            self._assume(written, "Ks", detail)

    def _bounces(self, written: MtlMaterial, made: dict[str, Any], model: int) -> None:
        shine = self._numbers(written, "ks", 3) if model in MIRRORS else None
        reflected = self._numbers(written, "kr", 3) or shine or ()
        if any(reflected):
            made["mirror"] = min(1.0, sum(reflected) / len(reflected))
            detail = f"It reflects with one share for all colours: {made['mirror']:.6g}."
            self._assume(written, "Kr" if "kr" in written.statements else "illum", detail)
        clear = 1 - self._number(written, "d", 1) or self._number(written, "tr", 0)
        if clear > 0 and model in GLASSES:
            made["transmission"] = min(1.0, clear)
            made["ior"] = self._number(written, "ni", 1.5) or 1.5
            detail = (
                f"It is glass: transmission {made['transmission']:.6g}, refractive index {made['ior']:.6g}."
            )
            self._assume(written, "illum", detail)
        elif clear > 0:
            self._leave_out(written, "d", "It is opaque: a scene can have glass, but no other transparency.")

    def _relief(self, written: MtlMaterial, made: dict[str, Any]) -> None:
        normals = self._texture(written, NORMAL_MAPS, "linear")
        bumps = self._texture(written, BUMP_MAPS, "linear")
        if normals is not None:
            made["normal_map"] = normals
            if bumps is not None:
                self._leave_out(
                    written,
                    _first(written, BUMP_MAPS),
                    "The bump map is left out: the normal map takes its place.",
                )
        elif bumps is not None:
            height = self._strength(written) * BUMP_SHARE * self.diagonal
            made |= {"bump_map": bumps, "bump_height": height}
            self._assume(
                written,
                _first(written, BUMP_MAPS),
                f"White is {height:.6g} scene units high: -bm times {BUMP_SHARE} of the mesh's "
                "diagonal, as the format names no unit. Change bump_height where that is not meant.",
            )

    def _strength(self, written: MtlMaterial) -> float:
        keyword = _first(written, BUMP_MAPS)
        named = written.map(keyword)
        given = named.options.get("-bm", ("1",)) if named else ("1",)
        strength = number_in(given[0]) if given else None
        if strength is None or not abs(strength * self.diagonal) <= MAX_COORDINATE:
            self._assume(written, keyword, "What follows -bm is not a number that can be used: 1 is used.")
            return 1.0
        return strength

    def _number(self, written: MtlMaterial, keyword: str, default: float) -> float:
        numbers = self._numbers(written, keyword, 1)
        return default if numbers is None else numbers[0]

    def _numbers(self, written: MtlMaterial, keyword: str, count: int) -> tuple[float, ...] | None:
        """Numbers of a statement; None if they are missing or cannot be used, which is noted.

        One number may stand for three equal ones.
        """
        statement = written.statements.get(keyword)
        if statement is None:
            return None
        words = statement.text.split()
        if words[:1] == ["-halo"]:
            words = words[1:]
            self._leave_out(written, keyword, "-halo is left out: transparency is the same from all sides.")
        numbers = [number for number in map(number_in, words) if number is not None and _is_usable(number)]
        if len(numbers) == 1:
            numbers *= count
        if len(numbers) < max(count, len(words)):
            things = "a number" if count == 1 else f"{count} numbers"
            detail = f"This line is left out: '{keyword}' needs {things} of 0 or more, no other words."
            self._leave_out(written, keyword, detail)
            return None
        if len(numbers) > count:
            used = "number is" if count == 1 else f"{count} numbers are"
            self._leave_out(written, keyword, f"Of these {len(numbers)} numbers only the first {used} used.")
        return tuple(numbers[:count])

    def _texture(self, written: MtlMaterial, keywords: tuple[str, ...], encoding: str) -> str | None:
        keyword = _first(written, keywords)
        named = written.map(keyword)
        return None if named is None else self._picture(written, keyword, named, encoding)

    def _picture(self, written: MtlMaterial, keyword: str, named: Map, encoding: str) -> str | None:
        try:
            asset = self._asset(named.name)
        except UNUSABLE_FILE_ERRORS as error:
            self._leave_out(written, keyword, str(error))
            return None
        for option in sorted(named.options.keys() - {"-bm", "-clamp"}):
            self._leave_out(
                written, keyword, f"The option {option} is left out: the picture is used as it is."
            )
        wrap = "clamp" if named.options.get("-clamp") == ("on",) else "repeat"
        stored = "linear" if PurePath(asset).suffix.lower() in LINEAR_LIGHT else encoding
        texture = {"type": "image", "asset": asset, "encoding": stored, "wrap": wrap}
        return named_texture(self.textures, texture)

    def _asset(self, name: str) -> str:
        if not name:
            raise FileAwayError("It names no picture. Write the file's name after it.")
        try:
            return picture_file(self.task, self.folder, name)
        except FileAwayError:
            if without_comment(name) in {name, ""}:
                raise
            return picture_file(self.task, self.folder, without_comment(name))

    def _others(self, written: MtlMaterial) -> None:
        for keyword, statement in written.statements.items():
            if keyword not in _CONVERTED and not all(number_in(word) == 0 for word in statement.text.split()):
                self._leave_out(
                    written, keyword, _REASONS.get(keyword, f"'{keyword}' has no counterpart here.")
                )

    def _assume(self, written: MtlMaterial, keyword: str, detail: str) -> None:
        self.task.notes.assume(
            f"{written.name}: {keyword}", detail, line=self._line(written, keyword), file=written.file
        )

    def _leave_out(self, written: MtlMaterial, keyword: str, detail: str) -> None:
        self.task.notes.leave_out(
            f"{written.name}: {keyword}", detail, line=self._line(written, keyword), file=written.file
        )

    @staticmethod
    def _line(written: MtlMaterial, keyword: str) -> int:
        statement = written.statements.get(keyword.lower())
        return statement.line if statement else written.line


def _first(written: MtlMaterial, keywords: tuple[str, ...]) -> str:
    """The first of several keywords for one thing that a material has, else the first of all."""
    return next((keyword for keyword in keywords if keyword in written.statements), keywords[0])


def _is_usable(number: float) -> bool:
    return 0 <= number <= MAX_INTENSITY
