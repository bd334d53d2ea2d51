"""Dataclasses of arrays are compared by identity: an `==` between arrays has no truth value."""

import builtins
import dataclasses
import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from renderer.math import arrays
from tests.architecture.sources import modules

NOT_IMPORTED = {"benchmarks", "docs", "scenes", "migrations", "__main__"}
"""Programs of the checkout, whose extras tests do without, and what Alembic and the interpreter run."""


class Names(dict[str, Any]):
    """Names of a module; those that it imports for its types only are the renderer's arrays, or anything."""

    def __missing__(self, name: str) -> Any:
        return getattr(builtins, name, getattr(arrays, name, Any))


def dataclasses_of(path: Path) -> Iterator[type]:
    """Dataclasses that a file defines."""
    parts = path.with_suffix("").parts
    name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
    for value in vars(importlib.import_module(name)).values():
        if isinstance(value, type) and dataclasses.is_dataclass(value) and value.__module__ == name:
            yield value


def holds_arrays(annotation: Any) -> bool:
    """Whether a value so annotated is an array, or a container of arrays."""
    origin = get_origin(annotation)
    # From NumPy 2.5 on `NDArray` is a type alias of its own where Python has these.
    meant = get_origin(getattr(origin, "__value__", None)) or origin
    return meant is np.ndarray or any(map(holds_arrays, get_args(annotation)))


def test_a_dataclass_of_arrays_has_no_generated_comparison() -> None:
    """Nor a hash of its arrays, which have none: `eq=False` leaves both to the object's identity."""
    imported = [path for path in modules() if not NOT_IMPORTED & {*path.parts, path.stem}]
    compared = [
        kind
        for path in imported
        for kind in dataclasses_of(path)
        if kind.__dataclass_params__.eq  # type: ignore[attr-defined]
        and any(map(holds_arrays, hints_of(kind).values()))
    ]
    assert compared == []


def hints_of(kind: type) -> dict[str, Any]:
    return get_type_hints(kind, localns=Names(vars(importlib.import_module(kind.__module__))))


def test_arrays_are_found_in_containers_and_behind_imports_for_types_only() -> None:
    assert holds_arrays(dict[str, tuple[arrays.Floats, ...]])
    assert holds_arrays(arrays.Masks | None)
    assert not holds_arrays(tuple[int, ...])
    from accuracy.study.reference import Reference

    assert holds_arrays(hints_of(Reference)["first"])
