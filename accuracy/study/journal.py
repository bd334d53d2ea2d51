"""The journal of a study: a line for each finished run, pictures of some, and the machine."""

from __future__ import annotations

import datetime as dt
import json
import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

from renderer.processors import usable_processors

if TYPE_CHECKING:
    from numpy.typing import NDArray

JOURNAL = "journal.jsonl"
PICTURES = "pictures"

CPU_INFO = Path("/proc/cpuinfo")

IDLE_LOAD = 0.5
"""Load of a machine that counts as idle."""


class Journal:
    """Runs of a study by their keys, in an append-only file.

    A line cut off by the death of its process is ignored, and its run repeated.

    Parameters
    ----------
    folder : Path
        Created if missing.
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
        """Record a run with its `key`; its picture is written before its line.

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


class Machine(TypedDict):
    """The machine and date of a measurement.

    `load` is the number of runnable processes, averaged over the last minute: above a few tenths, another
    program was using the machine and the times are too long.
    """

    date: str
    cpu: str
    cores: int
    load: float
    system: str
    python: str
    numpy: str
    penumbra: str


def describe() -> Machine:
    """Describe this machine as it is now."""
    return Machine(
        date=dt.datetime.now(tz=dt.UTC).isoformat(timespec="seconds"),
        cpu=_cpu(),
        cores=usable_processors(),
        load=round(os.getloadavg()[0], 2),
        system=platform.platform(aliased=True, terse=True),
        python=platform.python_version(),
        numpy=version("numpy"),
        penumbra=version("penumbra-render"),
    )


def _cpu() -> str:
    lines = CPU_INFO.read_text().splitlines() if CPU_INFO.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
