"""Documents made in Python: what NumPy, iterators and models hold, as the lists and numbers of JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from collections.abc import Set as AbstractSet

from pydantic import BaseModel

from schemas.limits import how_to_raise
from schemas.pointers import Parts
from schemas.reading.findings import Finding, refusal

_SCALARS = frozenset({str, int, float, bool, type(None)})
_NOT_JSON = "JSON has no {kind}. Write a number, a text, a list or a dict."
_NO_NAME = "The name of a field must be text."


def plain(content: object, *, max_depth: int) -> object:
    """Turn what Python has into what JSON has; every value that needs it is replaced in a copy.

    Arrays of any library become lists by their ``tolist``, so that nothing needs NumPy here. Iterators and
    ranges become lists too: some can be read but once. Numbers that are not finite stay as they are, for no
    field takes them, and each is reported in its place.

    Parameters
    ----------
    max_depth
        Objects and arrays inside each other, at most. It is the end of an object that contains itself.

    Raises
    ------
    SceneError
        With every value that JSON has no word for, or with the first that is nested too deep.
    """
    unfit: list[Finding] = []
    made = _Plain(content, max_depth, unfit).of(content, ())
    if unfit:
        raise refusal(unfit, content, None)
    return made


class _Plain:
    def __init__(self, content: object, max_depth: int, unfit: list[Finding]) -> None:
        self._content = content
        self._max_depth = max_depth
        self._unfit = unfit

    def of(self, value: object, parts: Parts) -> object:
        if isinstance(value, BaseModel):
            value = value.model_dump(mode="json", exclude_unset=True)
        if callable(listed := getattr(value, "tolist", None)):
            value = listed()
        if isinstance(value, Mapping):
            return self._object(value, parts)
        if isinstance(value, str | int | float | None):
            return value
        if isinstance(value, Iterable) and not isinstance(
            value, bytes | bytearray | memoryview | AbstractSet
        ):
            return self._array(value, parts)
        self._unfit.append(Finding(parts, "not_json", _NOT_JSON.format(kind=type(value).__name__)))
        return None

    def _object(self, value: Mapping[object, object], parts: Parts) -> dict[str, object]:
        self._refuse_too_deep(parts)
        members: dict[str, object] = {}
        for name, member in value.items():
            if isinstance(name, str):
                members[name] = member if type(member) in _SCALARS else self.of(member, (*parts, name))
            else:
                self._unfit.append(Finding(parts, "unknown_field", _NO_NAME))
        return members

    def _array(self, value: Iterable[object], parts: Parts) -> list[object]:
        self._refuse_too_deep(parts)
        return [
            entry if type(entry) in _SCALARS else self.of(entry, (*parts, number))
            for number, entry in enumerate(value)
        ]

    def _refuse_too_deep(self, parts: Parts) -> None:
        # At once, and not with the others: an object that contains itself twice has 2^64 places.
        if len(parts) >= self._max_depth:
            detail = (
                f"Objects and arrays are nested more than {self._max_depth} deep. Does one contain itself?"
            )
            detail = f"{detail} {how_to_raise('max_depth')}"
            raise refusal([Finding((), "too_deep", detail)], self._content, None)
