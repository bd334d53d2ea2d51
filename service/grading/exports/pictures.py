"""Embed pictures in a document as data URLs: all of them if they fit, else smaller or fewer."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from PIL import Image

from service.grading.exports.rows import Row
from service.grading.exports.texts import line, shortened

SCALES = (1, 2, 4)
"""Divisors of the width, tried in order; smaller pictures would be useless."""

LABEL = 40
"""Longest label in characters."""

AROUND = 300
"""Bytes that a document needs around each picture, including a label of four-byte characters."""

NOTE = 200
"""Bytes reserved for the note about missing pictures."""


@dataclass(frozen=True, slots=True)
class Shown:
    """A picture in a document."""

    label: str
    png: bytes

    @property
    def url(self) -> str:
        """The picture as a data URL."""
        return f"data:image/png;base64,{base64.b64encode(self.png).decode()}"

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        with Image.open(io.BytesIO(self.png)) as picture:
            return picture.size


@dataclass(frozen=True, slots=True)
class Album:
    """The pictures of all rows by id, and a note on how they were reduced to fit; empty if they were not."""

    by_id: Mapping[str, list[Shown]] = field(default_factory=dict)
    note: str = ""

    def of(self, row: Row) -> Sequence[Shown]:
        """The pictures of a row."""
        return self.by_id.get(row.id, ())


def album(rows: Sequence[Row], folder: Path | None, most: int | None = None) -> Album:
    """The pictures of rows, worst rows first, as long as there is room.

    Parameters
    ----------
    folder
        The folder of the result's pictures; None for no pictures. Missing files are skipped.
    most
        Bytes for all of them as data URLs; None for no limit.
    """
    if folder is None:
        return Album()
    files = [
        (row, shortened(line(image.label), LABEL), folder / image.file)
        for row in sorted(rows, key=lambda row: -row.lost)
        for image in row.images
        if (folder / image.file).is_file()
    ]
    room = math.inf if most is None else most - NOTE
    scale = _scale([file.stat().st_size for _, _, file in files], room)
    shown: dict[str, list[Shown]] = {}
    left_out = 0
    for row, label, file in files:
        picture = Shown(label, _smaller(file.read_bytes(), scale))
        needed = _encoded(len(picture.png))
        if needed > room or left_out:
            # Later pictures matter less: a small one must not replace one of a worse test.
            left_out += 1
            continue
        room -= needed
        shown.setdefault(row.id, []).append(picture)
    return Album(shown, _note(scale, left_out))


def _scale(sizes: Sequence[int], room: float) -> int:
    """The divisor for all pictures; assumes that bytes are proportional to pixels."""
    fitting = [scale for scale in SCALES if sum(_encoded(size // scale**2) for size in sizes) <= room]
    return fitting[0] if fitting else SCALES[-1]


def _encoded(size: int) -> int:
    return 4 * (-(-size // 3)) + AROUND


def _smaller(content: bytes, scale: int) -> bytes:
    if scale == 1:
        return content
    with Image.open(io.BytesIO(content)) as picture:
        small = picture.convert("RGB").reduce(scale)
    buffer = io.BytesIO()
    small.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def _note(scale: int, left_out: int) -> str:
    smaller = f"Pictures are shown at 1/{scale} of their size." if scale > 1 else ""
    counted = "1 picture is" if left_out == 1 else f"{left_out} pictures are"
    fewer = f"{counted} left out for lack of space, those of the best tests." if left_out else ""
    return " ".join(filter(None, (smaller, fewer)))
