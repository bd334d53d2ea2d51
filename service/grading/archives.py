"""Arrays from untrusted .npz files."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.math.arrays import Floats
from service.grading.folders import MOST_BYTES, Folder

SHAPE = "shape"
"""The array of shape indices, in which a miss is -1."""


def read_arrays(folder: Folder, name: str, wanted: Sequence[str]) -> dict[str, Floats]:
    """Read the arrays of these names as float64, without unpickling anything.

    Raises
    ------
    GradingError
        The file cannot be read, is not an .npz file, lacks an array, or holds other than real numbers.
    """
    content = folder.read(name)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            size = sum(member.file_size for member in packed.infolist())
        # A small archive may unpack to any size.
        if size > MOST_BYTES:
            raise folder.fault(f"{name} unpacks to {size} bytes; at most {MOST_BYTES} are read.")
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            found = {key: archive[key] for key in wanted if key in archive}
    except (ValueError, AttributeError, EOFError, TypeError, OSError, zipfile.BadZipFile) as error:
        raise folder.fault(f"{name} is not an .npz file of arrays. Write it with numpy.savez.") from error
    missing = [key for key in wanted if key not in found]
    if missing:
        raise folder.fault(f"{name} has no array {', '.join(map(repr, missing))}. Save them by these names.")
    for key, values in found.items():
        if values.dtype.kind not in "fiub":
            raise folder.fault(f"{name}: '{key}' holds {values.dtype}. It must hold real numbers.")
    return {key: _floats(key, values) for key, values in found.items()}


def _floats(key: str, values: NDArray[Any]) -> Floats:
    floats = np.asarray(values, dtype=np.float64)
    if key == SHAPE and values.dtype.kind == "u":
        # An unsigned type stores -1 as its largest number.
        floats = np.where(values == np.iinfo(values.dtype).max, -1.0, floats)
    return floats
