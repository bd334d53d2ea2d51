"""The tasks of a study: the picture to render, its reference, and the key of its run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from accuracy.study.journal import Machine
    from renderer.scenes import LoadedScene
    from schemas.quality import Quality

Part = Literal["reference", "setting", "precision", "whole", "effect", "size", "picture"]

KEY_DIGITS = 32
"""Hexadecimal digits of a key: 128 bits, so that no two keys of a study collide."""


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """A scene at the size of the study, whole or without one effect.

    Attributes
    ----------
    scene : LoadedScene
    key : str
        Digest of its content.
    effect : str
        The effect that is left out; empty for the whole scene.
    pointers : tuple of str
        Lines of the scene that ask for it.
    """

    scene: LoadedScene
    key: str
    effect: str = ""
    pointers: tuple[str, ...] = ()

    @classmethod
    def of(cls, scene: LoadedScene, effect: str = "", pointers: tuple[str, ...] = ()) -> Subject:
        """Make one of a scene."""
        return cls(scene, scene_key(scene), effect, pointers)


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """One picture to render.

    Attributes
    ----------
    part : str
        The part of the study that needs it.
    name : str
        Its name in that part.
    subject : Subject
    quality : Quality
    seed : int
    place : str
        Digest of the machine, since seconds depend on it.
    judges : tuple of Task
        The halves of the reference; empty if no error is needed.
    against : Task or None
        The task whose picture it is compared with.
    kept : bool
        Whether its picture is kept.
    key : str
        Digest of all this but part and name, so that equal tasks are rendered once.
    """

    part: Part
    name: str
    subject: Subject
    quality: Quality
    seed: int
    place: str
    judges: tuple[Task, ...] = ()
    against: Task | None = None
    kept: bool = False
    key: str = field(init=False)

    def __post_init__(self) -> None:
        key = key_of(
            self.place,
            self.subject.key,
            self.quality.model_dump(mode="json"),
            self.seed,
            [judge.key for judge in self.judges],
            self.against.key if self.against else None,
            self.kept,
        )
        object.__setattr__(self, "key", key)


def key_of(*parts: Any) -> str:
    """Digest of a JSON value.

    Examples
    --------
    >>> key_of({"a": 1, "b": 2}) == key_of({"b": 2, "a": 1})
    True
    """
    text = json.dumps(parts, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:KEY_DIGITS]


def scene_key(scene: LoadedScene) -> str:
    """Digest of a scene's content: its document without name, samples and display, and its files.

    Missing files are ignored here; compiling the scene reports them.
    """
    content = scene.document.model_dump(mode="json", exclude={"name", "sampling", "display"})
    files = {}
    for name in sorted(set(_assets(content))):
        with suppress(KeyError):
            files[name] = hashlib.sha256(scene.assets.read(name)).hexdigest()
    return key_of(content, files)


def place_key(machine: Machine) -> str:
    """Digest of the machine: processor and versions, but not date and load."""
    return key_of(
        [machine["cpu"], machine["cores"], machine["python"], machine["numpy"], machine["penumbra"]]
    )


def _assets(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        if isinstance(value.get("asset"), str):
            yield value["asset"]
        for part in value.values():
            yield from _assets(part)
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for part in value:
            yield from _assets(part)
