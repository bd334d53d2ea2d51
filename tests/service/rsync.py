"""What `rsync -a --exclude PATTERN SOURCE... TARGET/` does, for machines that do not have it."""

from __future__ import annotations

import fnmatch
import shutil
import sys
from pathlib import Path


def copy(sources: list[Path], target: Path, pattern: str) -> bool:
    """Copy folders and files into a folder. False if some were deleted meanwhile."""
    complete = True
    for source in sources:
        for path in [source, *source.rglob("*")]:
            if not path.is_file() or fnmatch.fnmatch(path.name, pattern):
                continue
            place = target / path.relative_to(source.parent)
            place.parent.mkdir(parents=True, exist_ok=True)
            try:
                shutil.copy2(path, place)
            except FileNotFoundError:
                complete = False
    return complete


if __name__ == "__main__":
    archive, exclude, pattern, *sources, target = sys.argv[1:]
    assert (archive, exclude) == ("-a", "--exclude")
    sys.exit(0 if copy([Path(source) for source in sources], Path(target), pattern) else 24)
