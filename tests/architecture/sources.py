"""Where the project's own files are, for the tests that read them."""

import ast
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("schemas", "renderer", "accuracy", "service", "scenes", "benchmarks", "tools")
FOLDERS = (*PACKAGES, "tests", "docs", "deploy", ".ci", ".github")
INSTALLED = {"__pycache__", "node_modules"}
"""Folders of files that come from elsewhere."""


def modules() -> list[Path]:
    """Python files of the packages, relative to the root."""
    return _within(PACKAGES, "*.py")


def python_files() -> list[Path]:
    """Python files of the packages, the tests and the documentation, relative to the root."""
    return _within(FOLDERS, "*.py")


def text_files() -> list[Path]:
    """Files that people read or edit, relative to the root."""
    suffixes = {".py", ".md", ".toml", ".json", ".yaml", ".yml", ".cff", ".html", ".js", ".css", ".ini", ""}
    top = (path.relative_to(ROOT) for path in ROOT.iterdir() if path.name != ".git" and path.is_file())
    return sorted(path for path in (*_within(FOLDERS, "*"), *top) if path.suffix in suffixes)


def _within(folders: Iterable[str], pattern: str) -> list[Path]:
    inside = (path for name in folders for path in (ROOT / name).rglob(pattern) if path.is_file())
    return sorted(path.relative_to(ROOT) for path in inside if not INSTALLED & set(path.parts))


def tree(path: Path) -> ast.Module:
    """Parse a file named relative to the root."""
    return ast.parse((ROOT / path).read_text(), filename=str(path))
