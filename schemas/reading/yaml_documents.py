"""Strict reader of YAML, restricted to the values of JSON, with the position of each.

Plain scalars mean what they mean in the core schema of YAML 1.2: `no` is text, and so is a date. Tags are
refused: nothing but numbers, text, truth values, lists and mappings comes out.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

import yaml

from schemas.errors import Problem, SceneError
from schemas.limits import Limits
from schemas.pointers import Parts
from schemas.reading.documents import Document
from schemas.reading.findings import Finding
from schemas.reading.positions import Place

_WORDS: dict[str, object] = {"": None, "~": None, "null": None, "true": True, "false": False}
_WHOLE = re.compile(r"[-+]?[0-9]{1,309}")
_REAL = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_USUAL = {
    yaml.ScalarNode: "tag:yaml.org,2002:str",
    yaml.SequenceNode: "tag:yaml.org,2002:seq",
    yaml.MappingNode: "tag:yaml.org,2002:map",
}

_TWICE = "This mapping has the same field more than once. Keep one of them."


def read_yaml(data: bytes, limits: Limits) -> Document:
    """Parse a document; its places are those of the YAML text.

    Raises
    ------
    SceneError
        It is too large, not UTF-8, not YAML, or holds what JSON could not.
    """
    if len(data) > limits.max_body_bytes:
        detail = f"The document has {len(data)} bytes; at most {limits.max_body_bytes} are allowed."
        raise _refused("too_large", detail)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise _refused("not_utf8", "The document is not UTF-8. Save it as UTF-8.") from None
    walk = _Walk(limits)
    content = walk.value_of(_root(text), ())
    return Document(content, text, walk.repeated, walk.find)


def _root(text: str) -> yaml.Node:
    try:
        # This loader returns every plain scalar as text, so that no type is guessed.
        node = yaml.BaseLoader(text).get_single_node()
    except yaml.MarkedYAMLError as error:
        raise _at(error.problem_mark, "not_yaml", f"This is not YAML: {error.problem}.") from None
    except yaml.YAMLError:
        raise _refused("not_yaml", "There is a character here that YAML does not allow.") from None
    except RecursionError:
        raise _refused("too_deep", "Lists and mappings are nested too deep.") from None
    if node is None:
        raise _refused("empty", "The document is empty. It must be a mapping.")
    return node


@dataclass(slots=True)
class _Walk:
    """Construct values from nodes, with the position of each."""

    limits: Limits
    count: int = 0
    repeated: list[Finding] = field(default_factory=list)
    positions: dict[Parts, Place] = field(default_factory=dict)

    def find(self, _: str, locations: Iterable[Parts]) -> dict[Parts, Place]:
        """The positions of locations that the document has."""
        return {parts: self.positions[parts] for parts in locations}

    def value_of(self, node: yaml.Node, parts: Parts) -> object:
        """Value of a node."""
        self._check(node, parts)
        self.positions.setdefault(parts, Place()).value = node.start_mark.index
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, parts)
        if isinstance(node, yaml.SequenceNode):
            return [self.value_of(item, (*parts, index)) for index, item in enumerate(node.value)]
        return node.value if node.style else _plain(node.value)

    def _mapping(self, node: yaml.MappingNode, parts: Parts) -> dict[str, object]:
        built: dict[str, object] = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise _at(key.start_mark, "not_text", "The name of a field must be text.")
            inner = (*parts, key.value)
            if key.value in built:
                self.repeated.append(Finding(inner, "duplicate_field", _TWICE, about_key=True))
            self.positions.setdefault(inner, Place()).keys.append(key.start_mark.index)
            built[key.value] = self.value_of(value, inner)
        return built

    def _check(self, node: yaml.Node, parts: Parts) -> None:
        # An alias stands for all that its anchor holds, so that a short text can mean any number of values.
        self.count += 1
        if self.count > self.limits.max_values:
            most = self.limits.max_values
            raise _at(node.start_mark, "too_large", f"The document has more than {most} values.")
        if len(parts) > self.limits.max_depth:
            most = self.limits.max_depth
            raise _at(node.start_mark, "too_deep", f"At most {most} levels may lie inside each other.")
        if node.tag != _USUAL[type(node)]:
            raise _at(node.start_mark, "tagged", "Tags are not read here. Remove what begins with '!'.")


def _plain(text: str) -> object:
    word = text.lower() if text.lower() in _WORDS else None
    if word is not None:
        return _WORDS[word]
    if _WHOLE.fullmatch(text):
        return int(text)
    return float(text) if _REAL.fullmatch(text) else text


def _at(mark: yaml.Mark | None, code: str, detail: str) -> SceneError:
    if mark is None:
        return _refused(code, detail)
    return SceneError(
        [Problem(pointer="", detail=detail, code=code, line=mark.line + 1, column=mark.column + 1)]
    )


def _refused(code: str, detail: str) -> SceneError:
    return SceneError([Problem(pointer="", detail=detail, code=code)])
