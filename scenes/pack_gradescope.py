"""Pack an assignment for Gradescope: ``python -m scenes.pack_gradescope WHEEL``."""

import argparse
import zipfile
from collections.abc import Iterator
from pathlib import Path

ASSIGNMENT = Path(__file__).parent / "assignment"
SCRIPTS = ASSIGNMENT / "gradescope"
MANIFEST = "manifest.yaml"
CONSTRAINTS = Path(__file__).parents[1] / "constraints.txt"
"""Versions that `setup.sh` installs; a checkout has them."""
LEFT_OUT = frozenset({"gradescope", "submissions"})
"""Folders that grading does not need."""


def pack(
    wheel: Path,
    target: Path,
    assignment: Path = ASSIGNMENT,
    manifest: str = MANIFEST,
    constraints: Path = CONSTRAINTS,
) -> list[str]:
    """Write the autograder archive of a Gradescope assignment.

    Parameters
    ----------
    wheel
        The package, built by ``pip wheel --no-deps``.
    target
        The archive.
    assignment
        The folder of the manifest: everything in it is packed except hidden files and `LEFT_OUT`.
    manifest
        Name of the YAML manifest in that folder.
    constraints
        A file of versions for pip: `setup.sh` installs these.

    Returns
    -------
    list of str
        The names in the archive; the scripts and the manifest are at its root, as Gradescope requires.
    """
    files = dict(_files(assignment))
    files[MANIFEST] = assignment / manifest
    files |= {script.name: script for script in SCRIPTS.iterdir() if script.is_file()}
    files[wheel.name] = wheel
    files["constraints.txt"] = constraints
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, path in sorted(files.items()):
            archive.write(path, name)
    return sorted(files)


def _files(folder: Path) -> Iterator[tuple[str, Path]]:
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        if path.is_file() and parts[0] not in LEFT_OUT and not any(part[0] in "._" for part in parts):
            yield "/".join(parts), path


def main() -> None:
    """Pack the assignment named on the command line, and print a summary."""
    parser = argparse.ArgumentParser(prog="python -m scenes.pack_gradescope", description=__doc__)
    parser.add_argument("wheel", type=Path, help="the package, penumbra_render-*.whl")
    parser.add_argument(
        "--assignment",
        type=Path,
        default=ASSIGNMENT,
        help="the folder of the manifest; by default the ready assignment",
    )
    parser.add_argument("--manifest", default=MANIFEST, help="name of the YAML manifest in that folder")
    parser.add_argument(
        "--constraints",
        type=Path,
        default=CONSTRAINTS,
        help="versions for pip; by default those of this checkout",
    )
    parser.add_argument("-o", "--out", type=Path, default=Path("autograder.zip"), help="the archive")
    arguments = parser.parse_args()
    for path in (arguments.wheel, arguments.assignment / arguments.manifest, arguments.constraints):
        if not path.is_file():
            parser.error(f"{path} is not there.")
    names = pack(
        arguments.wheel, arguments.out, arguments.assignment, arguments.manifest, arguments.constraints
    )
    print(f"{arguments.out}: {len(names)} files, {arguments.out.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
