"""Arrays that count the element operations made with them, for every array that NumPy makes meanwhile.

NumPy hands ufuncs and functions of a subclass to the subclass first (`__array_ufunc__`, NEP 13;
`__array_function__`, NEP 18). What it returns is counted again, so the count goes with the data from the
first array to the picture.
"""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple
from unittest import mock

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

_MAKERS = ("empty", "zeros", "ones", "full", "arange", "array", "asarray", "ascontiguousarray", "frombuffer")
"""Functions that no subclass is asked about, because none is among their arguments."""


class Operation(NamedTuple):
    """A kind of element operation: a ufunc's name and method, or `move`, and the types of its inputs."""

    name: str
    method: str
    types: tuple[str, ...]


@dataclass
class Tally:
    """Elements and calls of each kind of operation."""

    elements: Counter[Operation] = field(default_factory=Counter)
    calls: Counter[Operation] = field(default_factory=Counter)

    def add(self, operation: Operation, elements: int) -> None:
        """Count one call."""
        self.elements[operation] += elements
        self.calls[operation] += 1


class CountedArray(np.ndarray):
    """An array whose operations go to `tally`, one for all of them."""

    tally = Tally()

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        """Count the elements of the largest array of the call."""
        plain = [_plain(value) for value in inputs]
        out = options.pop("out", None)
        if out is not None:
            options["out"] = _plain(out)
        result = getattr(ufunc, method)(*plain, **{name: _plain(value) for name, value in options.items()})
        arrays = [value for value in (*plain, result) if isinstance(value, np.ndarray)]
        size = max((array.size for array in arrays), default=1)
        self.tally.add(Operation(ufunc.__name__, method, _types(plain[: ufunc.nin])), size)
        return _counted(result) if out is None else out[0] if len(out) == 1 else out

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        """Count what a function that is no ufunc gives or fills as moved; views cost nothing."""
        del types
        plain = _plain(args)
        result = function(*plain, **_plain(kwargs))
        if result is None or "out" in kwargs:
            self._move(kwargs.get("out", args[0]))
        elif not _is_view(result, plain):
            self._move(result)
        return _counted(result)

    def __getitem__(self, key: Any) -> Any:
        """A view costs nothing; what is picked by numbers or a mask is moved."""
        result = super().__getitem__(_plain(key))
        if isinstance(result, np.ndarray) and not np.may_share_memory(result, self):
            self._move(result)
        return result

    def __setitem__(self, key: Any, value: Any) -> None:
        """Assigned elements are moved."""
        super().__setitem__(_plain(key), _plain(value))
        self._move(self.view(np.ndarray)[_plain(key)])

    def astype(self, *args: Any, **kwargs: Any) -> Any:
        """Conversions are moves."""
        result = super().astype(*args, **kwargs)
        self._move(result)
        return result

    def _move(self, result: Any) -> None:
        for part in result if isinstance(result, tuple | list) else (result,):
            if isinstance(part, np.ndarray) and part.dtype.kind in "biuf":
                self.tally.add(Operation("move", "", (part.dtype.char,)), part.size)


def _is_view(result: Any, arguments: tuple[Any, ...]) -> bool:
    arrays = [value for value in (result, *arguments) if isinstance(value, np.ndarray)]
    others = arrays[1:] if isinstance(result, np.ndarray) else []
    return any(np.may_share_memory(result, other) for other in others)


def _types(inputs: list[Any]) -> tuple[str, ...]:
    """Type codes; a Python number takes the type of the arrays (NEP 50)."""
    own = [getattr(value, "dtype", None) for value in inputs]
    arrays = next(dtype for dtype in own if dtype is not None)
    return tuple((dtype or arrays).char for dtype in own)


def _plain(value: Any) -> Any:
    if isinstance(value, CountedArray):
        return value.view(np.ndarray)
    if isinstance(value, tuple | list):
        return type(value)(_plain(part) for part in value)
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    return value


def _counted(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return type(value)(_counted(part) for part in value)
    return value.view(CountedArray) if isinstance(value, np.ndarray) else value


@contextmanager
def counting() -> Iterator[Tally]:
    """Count the operations of all arrays that are made inside."""
    CountedArray.tally = tally = Tally()

    def counted_maker(maker: Any) -> Any:
        return lambda *args, **kwargs: _counted(maker(*_plain(args), **_plain(kwargs)))

    makers = {name: counted_maker(getattr(np, name)) for name in _MAKERS}
    with mock.patch.multiple(np, **makers):
        yield tally
