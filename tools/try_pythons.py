"""Run tests on every supported Python of this machine, with pinned, newest and oldest dependencies.

    make test-pythons                                                     # the quick tests, on all of them
    python tools/try_pythons.py 3.13-newest --tests tests/renderer

An interpreter that is on the path or that pyenv has is used; one that is missing is named. Each combination
has an environment of its own in `out/pythons`. The oldest NumPy is tried on the oldest Python.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

VERSIONS = ("3.11", "3.12", "3.13", "3.14")
OLDEST_NUMPY = "numpy==2.2.*"
"""As pyproject.toml has it; a test compares."""

CHOICES: dict[str, list[str]] = {
    "pinned": ["--constraint", "constraints.txt"],
    "newest": ["--upgrade", "--upgrade-strategy", "eager"],
    "oldest-numpy": [OLDEST_NUMPY],
}
"""Arguments of pip for each choice of versions."""

EXTRAS = ".[mesh,exr,numerics,study,postgres,test]"
ENVIRONMENTS = Path("out/pythons")


def interpreter(version: str) -> str | None:
    """Find a Python of a version: on the path, or among those of pyenv."""
    found = shutil.which(f"python{version}")
    # pyenv puts stand-ins on the path that fail unless the version is chosen.
    if found and "shims" not in found:
        return found
    kept = sorted((Path.home() / ".pyenv" / "versions").glob(f"{version}.*/bin/python"))
    return str(kept[-1]) if kept else None


def combinations() -> list[str]:
    """All names, such as `3.12-newest`."""
    both = [f"{version}-{choice}" for version in VERSIONS for choice in ("pinned", "newest")]
    return [*both, f"{VERSIONS[0]}-oldest-numpy"]


def prepared(name: str, python: str) -> Path:
    """Make the environment of a combination, and return its Python."""
    folder = ENVIRONMENTS / name
    own = folder / "bin" / "python"
    if not own.exists():
        subprocess.run([python, "-m", "venv", str(folder)], check=True)
    choice = CHOICES[name.partition("-")[2]]
    subprocess.run([str(own), "-m", "pip", "install", "--quiet", "--editable", EXTRAS, *choice], check=True)
    return own


def tried(name: str, tests: list[str]) -> str:
    """Run the tests in one combination, and say how that ended."""
    python = interpreter(name.partition("-")[0])
    if python is None:
        return "no such Python on this machine"
    try:
        own = prepared(name, python)
    except subprocess.CalledProcessError:
        return "FAILED to install"
    program = "import numpy; print('NumPy', numpy.__version__)"
    numpy = subprocess.run([own, "-c", program], capture_output=True, text=True, check=True).stdout.strip()
    command = [str(own), "-m", "pytest", "-q", "-m", "not slow and not peer", "-n", "auto", *tests]
    code = subprocess.run(command, check=False).returncode
    return f"{'FAILED' if code else 'passed'} with {numpy}"


def main() -> int:
    """Try the combinations, and list how each ended."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(combinations()))
    parser.add_argument("--tests", nargs="+", required=True, help="files and folders of tests")
    options = parser.parse_args()
    if unknown := set(options.names) - set(combinations()):
        parser.error(f"no {', '.join(sorted(unknown))}; there are {', '.join(combinations())}")
    ended = {name: tried(name, options.tests) for name in options.names or combinations()}
    for name, outcome in ended.items():
        sys.stdout.write(f"{name:<20} {outcome}\n")
    return 1 if any(outcome.startswith("FAILED") for outcome in ended.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
