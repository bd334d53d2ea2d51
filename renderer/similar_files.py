"""Suggestions for a missing file: similar names in its folder."""

from pathlib import Path, PurePosixPath


def did_you_mean(folder: Path, name: str) -> str:
    r"""Ask whether a similar file in a folder was meant; empty if there is none.

    It differs by capitals, or by the folders of another computer, as in `C:\models\cube.obj`.
    """
    parts = [part for part in PurePosixPath(name.replace("\\", "/")).parts if part != "/"]
    for first in range(len(parts)):
        try:
            found = _found(folder, parts[first:])
        except (OSError, ValueError):
            return ""
        if found is not None:
            return f" Did you mean {found.relative_to(folder).as_posix()!r}?"
    return ""


def _found(folder: Path, parts: list[str]) -> Path | None:
    """The file of these names below a folder, whatever their capitals; links lead nowhere."""
    for part in parts[:-1]:
        there = [path for path in _same(folder, part) if path.is_dir()]
        if not there:
            return None
        folder = there[0]
    return next((path for path in _same(folder, parts[-1]) if path.is_file()), None)


def _same(folder: Path, name: str) -> list[Path]:
    """Entries of a folder with that name, an exact match first."""
    same = [path for path in folder.iterdir() if path.name.casefold() == name.casefold()]
    return sorted(
        (path for path in same if not path.is_symlink()), key=lambda path: (path.name != name, path)
    )
