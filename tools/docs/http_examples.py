"""Send the examples of the HTTP reference to a service, and shorten what it answers."""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
import time
import tomllib
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
SOURCE = Path(__file__).with_name("http_examples.toml")
KEPT = ROOT / "docs" / "figures" / "http_examples.json"
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


@contextmanager
def service(folder: Path) -> Iterator[str]:
    """Run a service on a free port, and give its address."""
    log = folder / "log"
    words = [sys.executable, "-m", "service.cli.main", "serve", "--port", "0", "--workers", "2", "--data"]
    own = {name: value for name, value in os.environ.items() if not name.startswith("PENUMBRA_")}
    with log.open("wb") as stderr:
        process = subprocess.Popen([*words, str(folder / "data")], stderr=stderr, cwd=ROOT, env=own)
    try:
        while (found := re.search(r"http://127\.0\.0\.1:\d+", log.read_text())) is None:
            if process.poll() is not None:
                sys.exit(log.read_text())
            time.sleep(0.05)
        yield found[0]
    finally:
        process.terminate()
        process.wait()


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


def has_shape(kept: Any, found: Any) -> bool:
    """Whether two shapes agree. What is null or empty in one of them may be anything in the other."""
    if kept in (None, []) or found in (None, []):
        return True
    if isinstance(kept, dict) and isinstance(found, dict):
        return kept.keys() == found.keys() and all(has_shape(kept[name], found[name]) for name in kept)
    if isinstance(kept, list) and isinstance(found, list):
        return has_shape(kept[0], found[0])
    return bool(kept == found)


def document_lines(value: Any) -> list[str]:
    """Write a JSON object with a line for each of its fields; what does not fit is left out."""
    fields = [f"  {json.dumps(name)}: " for name in value]
    lines = [
        field + shortened(part, WIDTH - len(field) - 1)
        for field, part in zip(fields, value.values(), strict=True)
    ]
    return ["{", *(f"{line}," for line in lines[:-1]), *lines[-1:], "}"]


def shortened(value: Any, room: int) -> str:
    """Write a value in at most so many letters, with … for what is left out.

    >>> shortened({"a": [1, 2, 3, 4, 5, 6, 7], "b": "text"}, 24)
    '{"a": [1, 2, 3, …], …}'
    """
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


def differences(kept: dict[str, Any], found: dict[str, Any]) -> list[str]:
    """Say how the response of a call differs from the kept one: in its status, its headers, or its fields."""
    return [
        what
        for what, same in (
            (f"status {found['status']}", kept["status"] == found["status"]),
            (f"headers {sorted(found['headers'])}", kept["headers"].keys() == found["headers"].keys()),
            (f"shape {found['shape']}", has_shape(kept["shape"], found["shape"])),
        )
        if not same
    ]
