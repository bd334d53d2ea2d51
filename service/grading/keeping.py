"""Pictures of mistakes, kept while a class is graded: other submissions have made the same mistake."""

from __future__ import annotations

import hashlib
import io
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def kept(folder: Path | None, key: str, render: Callable[[], NDArray[np.float32]]) -> NDArray[np.float32]:
    """A picture from a folder; if it is not there yet, it is rendered and put there.

    Parameters
    ----------
    folder
        None if no other submission follows: then nothing is kept.
    key
        All that the picture depends on. Of files that a scene names, only the names need to be in it: they
        must not change while the folder is used.
    render
        Makes the picture, (H, W, 3).
    """
    if folder is None:
        return render()
    file = folder / f"{hashlib.sha256(key.encode()).hexdigest()}.npy"
    if file.exists():
        picture: NDArray[np.float32] = np.load(file, allow_pickle=False)
        return picture
    picture = render()
    content = io.BytesIO()
    np.save(content, picture)
    with tempfile.NamedTemporaryFile(dir=folder, delete=False) as whole:
        whole.write(content.getvalue())
    # Two tests may make the same picture; renaming leaves a complete file.
    Path(whole.name).replace(file)
    return picture
