"""A problem's pointer, line and column name exactly the place that is wrong, however the text is written."""

import copy
import json
import random
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from schemas.errors import SceneError
from schemas.pointers import Parts, pointer
from schemas.reading import read_scene
from schemas.reading.positions import line_and_column, locate

CHANCE = st.integers(0, 1 << 32).map(random.Random)
KEYS = st.text(max_size=4)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=20,
)


class Writer:
    """Writes JSON with arbitrary blanks and escapes, and notes where each value and key begins."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.text = ""
        self.values: dict[Parts, int] = {}
        self.keys: dict[Parts, int] = {}

    def blank(self) -> str:
        return self.chance.choice(["", "", " ", "\n", "\r\n\t "])

    def escape(self) -> bool:
        return self.chance.random() < 0.5

    def write(self, value: object, parts: Parts = ()) -> None:
        self.text += self.blank()
        self.values[parts] = len(self.text)
        if isinstance(value, dict):
            self._write_all("{}", ((key, inner) for key, inner in value.items()), parts)
        elif isinstance(value, list):
            self._write_all("[]", enumerate(value), parts)
        else:
            self.text += json.dumps(value, ensure_ascii=self.escape())
        self.text += self.blank()

    def _write_all(self, brackets: str, items: Iterator[tuple[Any, object]], parts: Parts) -> None:
        self.text += brackets[0]
        first = True
        for part, value in items:
            self.text += "" if first else ","
            first = False
            if brackets == "{}":
                self.text += self.blank()
                self.keys[*parts, part] = len(self.text)
                self.text += json.dumps(part, ensure_ascii=self.escape()) + self.blank() + ":"
            self.write(value, (*parts, part))
        self.text += (self.blank() if first else "") + brackets[1]


def places(content: object, parts: Parts = ()) -> Iterator[Parts]:
    yield parts
    if isinstance(content, dict | list):
        for part, inner in content.items() if isinstance(content, dict) else enumerate(content):
            yield from places(inner, (*parts, part))


def replaced(content: Any, parts: Parts, value: object) -> Any:
    content = copy.deepcopy(content)
    node = content
    for part in parts[:-1]:
        node = node[part]
    node[parts[-1]] = value
    return content


@given(content=VALUES, chance=CHANCE)
def test_values_and_keys_are_located(content: object, chance: random.Random) -> None:
    writer = Writer(chance)
    writer.write(content)
    found = locate(writer.text, writer.values)
    assert {parts: place.value for parts, place in found.items()} == writer.values
    assert {parts: place.keys for parts, place in found.items() if place.keys} == {
        parts: [offset] for parts, offset in writer.keys.items()
    }


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), chance=CHANCE)
def test_wrong_kind_is_located(scene: dict[str, Any], data: st.DataObject, chance: random.Random) -> None:
    # Every place of a scene refuses an array of an array of text, so exactly this place is wrong.
    place = data.draw(st.sampled_from([parts for parts in places(scene) if parts]))
    writer = Writer(chance)
    writer.write(replaced(scene, place, [["\N{PERFORMING ARTS}"]]))
    with pytest.raises(SceneError) as caught:
        read_scene(writer.text.encode())
    reported = {problem.pointer: (problem.line, problem.column) for problem in caught.value.errors}
    inner = {written for written in writer.values if written[: len(place)] == place}
    nearest = [parts for parts in inner if pointer(parts) in reported]
    assert nearest
    for parts in nearest:
        assert reported[pointer(parts)] == line_and_column(writer.text, writer.values[parts])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    data=st.data(), chance=CHANCE, wrong=st.sampled_from([None, True, "1", float("nan"), float("inf"), -1e16])
)
def test_wrong_number_is_located(
    scene: dict[str, Any], data: st.DataObject, chance: random.Random, wrong: object
) -> None:
    numbers = [
        parts for parts, value in walk(scene) if isinstance(value, int | float) and parts != ("version",)
    ]
    place = data.draw(st.sampled_from(numbers))
    writer = Writer(chance)
    writer.write(replaced(scene, place, wrong))
    with pytest.raises(SceneError) as caught:
        read_scene(writer.text)
    (problem,) = caught.value.errors
    assert problem.pointer == pointer(place)
    assert (problem.line, problem.column) == line_and_column(writer.text, writer.values[place])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    data=st.data(),
    chance=CHANCE,
    key=st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=8),
)
def test_unknown_field_is_located(
    scene: dict[str, Any], data: st.DataObject, chance: random.Random, key: str
) -> None:
    closed = [
        parts
        for parts, value in walk(scene)
        if isinstance(value, dict) and parts not in {("materials",), ("textures",)}
    ]
    place = data.draw(st.sampled_from(closed))
    key = f"?{key}"
    writer = Writer(chance)
    writer.write(replaced(scene, (*place, key), 1))
    with pytest.raises(SceneError) as caught:
        read_scene(writer.text)
    (problem,) = caught.value.errors
    assert (problem.pointer, problem.code) == (pointer((*place, key)), "unknown_field")
    assert (problem.line, problem.column) == line_and_column(writer.text, writer.keys[*place, key])


def walk(content: Any) -> Iterator[tuple[Parts, object]]:
    for parts in places(content):
        value = content
        for part in parts:
            value = value[part]
        yield parts, value
