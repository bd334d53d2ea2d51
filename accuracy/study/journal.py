"""The journal of a study: a line for each run that is done, and pictures that others are compared with."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

JOURNAL = "journal.jsonl"
PICTURES = "pictures"


class Journal:
    """Runs of a study by their keys; the file is only ever added to.

    A line that was not written whole, as its process was killed, is passed over, and its run is done again.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    """

    def __init__(self, folder: Path) -> None:
        self._pictures = folder / PICTURES
        self._pictures.mkdir(parents=True, exist_ok=True)
        self._path = folder / JOURNAL
        self._entries: dict[str, dict[str, Any]] = {}
        text = self._path.read_text(encoding="utf-8") if self._path.exists() else ""
        for line in text.splitlines():
            entry = _parsed(line)
            if entry is not None:
                self._entries[entry["key"]] = entry
        self._torn = bool(text) and not text.endswith("\n")

    def __contains__(self, key: object) -> bool:
        return key in self._entries

    def __getitem__(self, key: str) -> dict[str, Any]:
        return self._entries[key]

    def __len__(self) -> int:
        return len(self._entries)

    def add(self, entry: dict[str, Any], picture: NDArray[np.float32] | None = None) -> None:
        """Note a run, which has its `key`; its picture is there before its line is.

        Raises
        ------
        OSError
            It cannot be written.
        """
        if picture is not None:
            self._save(entry["key"], picture)
        with self._path.open("a", encoding="utf-8") as file:
            # A new line first ends one that was cut off.
            file.write("\n" * self._torn + json.dumps(entry, allow_nan=False) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self._torn = False
        self._entries[entry["key"]] = entry

    def has_picture(self, key: str) -> bool:
        """Whether the picture of a run was kept."""
        return self._picture(key).exists()

    def picture(self, key: str) -> NDArray[np.float32]:
        """A picture that was kept, (H, W, 3) float32 linear."""
        pixels: NDArray[np.float32] = np.load(self._picture(key), allow_pickle=False)
        return pixels

    def _save(self, key: str, picture: NDArray[np.float32]) -> None:
        temporary = self._pictures / f".{key}.npy"
        with temporary.open("wb") as file:
            np.save(file, picture, allow_pickle=False)
        temporary.replace(self._picture(key))

    def _picture(self, key: str) -> Path:
        return self._pictures / f"{key}.npy"


def _parsed(line: str) -> dict[str, Any] | None:
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    return entry if isinstance(entry, dict) and "key" in entry else None
