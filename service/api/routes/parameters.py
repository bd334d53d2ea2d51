"""Parameters, headers and bodies that several routes share."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any

from fastapi import Header, Query, Request
from pydantic import AfterValidator, BaseModel, Field
from pydantic_core import PydanticCustomError

from schemas.api.jobs import LABEL_NAME, LABEL_NAMES
from schemas.errors import ProblemDocument
from service.api.problems import MEDIA_TYPE
from service.api.request_headers import joined

After = Annotated[int, Query(ge=0, le=2**31 - 1, description="Return the events with higher numbers.")]
Wait = Annotated[
    float,
    Query(
        ge=0, le=3600, description="Wait up to this many seconds for new events; the service may wait less."
    ),
]
Prefer = Annotated[list[str] | None, Header(description="`wait=N` waits up to N seconds for the job to end.")]

_KEY = r"[\x21-\x7e]{1,255}"
_LABEL = rf"{LABEL_NAME}:[\s\S]{{0,200}}"


def _key(key: str | None) -> str | None:
    if key is not None and not re.fullmatch(_KEY, key):
        message = "It has 1 to 255 characters: ASCII letters, digits and punctuation, without spaces"
        raise PydanticCustomError("idempotency_key", message)
    return key


def _label(label: str) -> str:
    if not re.fullmatch(_LABEL, label):
        message = f"It is name:value, with a value of at most 200 characters. {LABEL_NAMES.removesuffix('.')}"
        raise PydanticCustomError("label", message)
    return label


IdempotencyKey = Annotated[
    str | None,
    Header(
        json_schema_extra={"pattern": f"^{_KEY}$"},
        description="A key of your choice, 1 to 255 printable ASCII characters without spaces: for 24 hours "
        "the same request with it creates no second job.",
    ),
    AfterValidator(_key),
]
LabelFilter = Annotated[str, Field(json_schema_extra={"pattern": f"^{_LABEL}$"}), AfterValidator(_label)]

WAIT = re.compile(
    r"(?:^|[,;])\s*wait\s*=\s*(\"?)(\d{1,18}(?:\.\d{1,6})?)\1\s*(?:$|[,;])", re.IGNORECASE | re.ASCII
)
BINARY: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
COMPONENTS = "#/components/schemas/{model}"


CODES = "x-codes"
"""OpenAPI extension that lists the codes of a response's problem document."""


def problem(status: int, description: str, *codes: str) -> dict[int | str, dict[str, Any]]:
    """Describe an error response for the OpenAPI document.

    Parameters
    ----------
    codes
        Values of `code` in the problem document.
    """
    schema = {"$ref": COMPONENTS.format(model=ProblemDocument.__name__)}
    return {
        status: {
            "description": description,
            "content": {MEDIA_TYPE: {"schema": schema}},
            CODES: list(codes),
        }
    }


CHANGED = problem(
    412,
    "It is another version than `If-Match` or `If-Unmodified-Since` asks for.",
    "precondition_failed",
)


def json_request(model: type[BaseModel], example: dict[str, Any] | None = None) -> dict[str, Any]:
    """Describe a body that the route reads itself, so that problems have lines and columns."""
    content: dict[str, Any] = {"schema": {"$ref": COMPONENTS.format(model=model.__name__)}}
    if example is not None:
        content["example"] = example
    return {"requestBody": {"required": True, "content": {"application/json": content}}}


def preferred_wait(prefer: Sequence[str] | None, longest: float) -> float:
    """Read the seconds of ``Prefer: wait=N`` (RFC 7240), a header that may come in parts; 0 without it.

    >>> [preferred_wait(parts, 60.0) for parts in (["respond-async, wait=10"], ["a", 'wait="90"'], None)]
    [10.0, 60.0, 0.0]
    """
    found = WAIT.search(", ".join(prefer or ()))
    return min(float(found[2]), longest) if found else 0.0


def negotiate(request: Request, offered: Sequence[str]) -> str:
    """Choose the media type that the Accept headers of a request prefer."""
    return preferred_type(joined(request, "accept"), offered)


def preferred_type(accept: str, offered: Sequence[str]) -> str:
    """Choose one of the offered media types (RFC 9110, section 12.5.1); the first where none is accepted.

    Each type has the weight of the range that fits it most closely. Of types with the same weight the one
    whose range comes first is chosen.

    >>> forms = ("application/json", "text/csv")
    >>> [
    ...     preferred_type(accept, forms)
    ...     for accept in ("text/*;q=0.5", "*/*", "application/json;q=0, */*", "image/png")
    ... ]
    ['text/csv', 'application/json', 'text/csv', 'application/json']
    """
    ranges = [_range(part) for part in accept.split(",")]
    weighed = [(_weight(media_type, ranges), media_type) for media_type in offered]
    (weight, _), best = max(weighed, key=lambda found: found[0])
    return best if weight > 0 else offered[0]


def _weight(media_type: str, ranges: Sequence[tuple[str, float]]) -> tuple[float, int]:
    """Return the weight of a type and the negated index of the range that gives it."""
    for pattern in (media_type, f"{media_type.partition('/')[0]}/*", "*/*"):
        for place, (found, weight) in enumerate(ranges):
            if found == pattern:
                return weight, -place
    return 0.0, 0


def _range(part: str) -> tuple[str, float]:
    pattern, *parameters = (word.strip().lower() for word in part.split(";"))
    weights = [word.removeprefix("q=") for word in parameters if word.startswith("q=")]
    try:
        return pattern, float(weights[0]) if weights else 1.0
    except ValueError:
        return pattern, 0.0
