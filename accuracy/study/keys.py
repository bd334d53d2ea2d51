"""What makes two runs the same: everything that their picture and their seconds depend on, as one digest."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from accuracy.study.machine import Machine
    from renderer.scenes import LoadedScene

LENGTH = 32
"""Hexadecimal digits of a key: 128 bits, so no two keys of a study are the same by chance."""


def key_of(*parts: Any) -> str:
    """Digest of what can be written as JSON.

    Examples
    --------
    >>> key_of({"a": 1, "b": 2}) == key_of({"b": 2, "a": 1})
    True
    """
    text = json.dumps(parts, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


def scene_key(scene: LoadedScene) -> str:
    """Digest of what a scene shows: its document without name, samples and display, and its files.

    A file that is missing counts as none; compiling the scene says what is wrong.
    """
    content = scene.document.model_dump(mode="json", exclude={"name", "sampling", "display"})
    files = {}
    for name in sorted(set(_assets(content))):
        with suppress(KeyError):
            files[name] = hashlib.sha256(scene.assets.read(name)).hexdigest()
    return key_of(content, files)


def place_key(machine: Machine) -> str:
    """Digest of what seconds depend on beside the scene: processor and versions, but not date and load."""
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
