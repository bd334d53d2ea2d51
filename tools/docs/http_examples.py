"""Send the examples of the HTTP reference to a service, and shorten what it answers.

``python -m tools.docs.http_examples`` starts a service, sends it the examples of ``http_examples.toml``, and
keeps the responses in ``http_examples.json``. ``python -m tools.docs.write_pages`` writes the page from them.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import tempfile
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator

SOURCE = Path(__file__).with_name("http_examples.toml")
KEPT = SOURCE.with_suffix(".json")
EXAMPLES: dict[str, Any] = tomllib.loads(SOURCE.read_text(encoding="utf-8"))
LOCAL = "http://127.0.0.1:8000"
SECONDS = 180
"""A service that takes longer for all examples together is stuck."""

NOTED = (
    "content-type", "location", "etag", "x-progress", "content-range", "accept-ranges",
    "idempotency-replayed", "ratelimit", "ratelimit-policy", "retry-after", "vary",
)  # fmt: skip
"""Headers that are shown and compared."""
WIDTH = 118
"""Letters of a line, so that a block fits into a page without a scroll bar."""
LEAST = 8
"""Letters for which a part of a value is worth its beginning."""
FIRST, LAST = 6, 3
"""Lines that are shown of a long text."""
DEEPEST = 3
"""Levels of objects whose fields are compared: below them are JSON Schemas, which have tests of their own."""
_ID = re.compile(r"(?<![.\w])(?=[0-9]*[a-f])[0-9a-f]{16,64}\b")
_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d+)?(?:Z|\+00:00)")
_SHOWN_TIME = "2026-11-23T10:00:00Z"


def kept() -> dict[str, dict[str, Any]]:
    """The recorded response of each call."""
    responses: dict[str, dict[str, Any]] = json.loads(KEPT.read_text(encoding="utf-8"))
    return responses


def answers(url: str, folder: Path) -> dict[str, dict[str, Any]]:
    """Run the examples as a reader would, in one shell in a folder, and describe the response of each call.

    Raises
    ------
    subprocess.CalledProcessError
        If a command fails.
    """
    examples = EXAMPLES["example"]
    blocks = [f"{{\n{example['run'].strip()}\n}} > answer-{i}" for i, example in enumerate(examples)]
    script = "\n".join(["set -eu -o pipefail", EXAMPLES["setup"], *blocks]).replace(LOCAL, url)
    subprocess.run(
        ["bash", "-c", script], cwd=folder, check=True, capture_output=True, text=True, timeout=SECONDS
    )
    masked: dict[str, str] = {}
    return {
        example["call"]: described((folder / f"answer-{i}").read_bytes(), masked)
        for i, example in enumerate(examples)
    }


def described(printed: bytes, masked: dict[str, str]) -> dict[str, Any]:
    """Describe what curl printed: status, headers, the shape of a JSON body, and the lines that are shown."""
    head, _, body = printed.decode().partition("\r\n\r\n")
    status, *lines = mask(head, masked).splitlines()
    headers = {name.lower(): value for name, _, value in (line.partition(": ") for line in lines)}
    is_json = "json" in headers.get("content-type", "") and body
    value = json.loads(mask(body, masked)) if is_json else None
    return {
        "status": status,
        "headers": {name: headers[name] for name in NOTED if name in headers},
        "shape": shape(value),
        "body": document_lines(value) if is_json else text_lines(mask(body, masked)),
    }


def mask(text: str, masked: dict[str, str]) -> str:
    """Replace ids and times, which are others each time: equal ids by equal ones."""

    def same(match: re.Match[str]) -> str:
        number = len(masked) + 1
        made = hashlib.sha256(str(number).encode()).hexdigest()[: len(match[0])]
        return masked.setdefault(match[0], made)

    return _ID.sub(same, _TIME.sub(_SHOWN_TIME, text))


def shape(value: Any, depth: int = 0) -> Any:
    """The fields of a value with their types; of a list, those of its first member."""
    if isinstance(value, dict):
        return {name: shape(part, depth + 1) for name, part in value.items()} if depth < DEEPEST else {}
    if isinstance(value, list):
        return [shape(part, depth) for part in value[:1]]
    if value is None or isinstance(value, bool):
        return value and "boolean"
    return "number" if isinstance(value, int | float) else "text"


def document_lines(value: Any) -> list[str]:
    """Write a JSON object with a line for each of its fields; what does not fit is left out."""
    fields = [f"  {json.dumps(name)}: " for name in value]
    lines = [
        field + shortened(part, WIDTH - len(field) - 1)
        for field, part in zip(fields, value.values(), strict=True)
    ]
    return ["{", *(f"{line}," for line in lines[:-1]), *lines[-1:], "}"]


def shortened(value: Any, room: int) -> str:
    """Write a value in at most so many letters, with … for what is left out."""
    text = json.dumps(value, ensure_ascii=False)
    if len(text) <= room:
        return text
    if isinstance(value, str):
        return f'"{value[: max(room - 3, 0)]}…"'
    if not isinstance(value, dict | list):
        return text
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return f"{opening}{', '.join(_members(value, room))}{closing}"


def _members(value: dict[str, Any] | list[Any], room: int) -> Iterator[str]:
    """Write the members of an object or an array until there is no more room."""
    room -= len("{, …}")
    members = value.items() if isinstance(value, dict) else [(None, part) for part in value]
    for name, part in members:
        field = "" if name is None else f"{json.dumps(name)}: "
        text = field + shortened(part, room - len(field))
        if len(text) > room or room - len(field) < LEAST:
            yield "…"
            return
        yield text
        room -= len(text) + len(", ")


def text_lines(text: str) -> list[str]:
    """Give the first lines of a text, and the last of a long one, each cut at the width of the page."""
    lines = [line if len(line) <= WIDTH else f"{line[: WIDTH - 1]}…" for line in text.rstrip().splitlines()]
    if len(lines) > FIRST + LAST + 1:
        lines = [*lines[:FIRST], "…", *lines[-LAST:]]
    return lines


def record() -> None:
    """Keep the responses of a service that is started for it."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        settings = Settings(data=folder / "data", port=0, workers=2, log_level="error")
        with running(settings) as server:
            found = answers(server.url, folder)
    KEPT.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    record()
