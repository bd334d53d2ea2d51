"""Where the project's own files are, for the tests that read them."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("schemas", "renderer", "accuracy", "service", "scenes", "benchmarks", "tools")
FOLDERS = (*PACKAGES, "tests", "docs", "deploy", ".ci")


def modules() -> list[Path]:
    """Python files of the packages, relative to the root."""
    return sorted(path.relative_to(ROOT) for name in PACKAGES for path in (ROOT / name).rglob("*.py"))


def python_files() -> list[Path]:
    """Python files of the packages, the tests and the documentation, relative to the root."""
    return sorted(path.relative_to(ROOT) for name in FOLDERS for path in (ROOT / name).rglob("*.py"))


def text_files() -> list[Path]:
    """Files that people read or edit, relative to the root."""
    suffixes = {".py", ".md", ".toml", ".json", ".yaml", ".yml", ".html", ".js", ".css", ".ini", ""}
    inside = (path for name in FOLDERS for path in (ROOT / name).rglob("*"))
    top = (path for path in ROOT.iterdir() if path.name != ".git")
    return sorted(
        path.relative_to(ROOT)
        for path in (*inside, *top)
        if path.is_file() and path.suffix in suffixes and "__pycache__" not in path.parts
    )


def tree(path: Path) -> ast.Module:
    """Parse a file named relative to the root."""
    return ast.parse((ROOT / path).read_text(), filename=str(path))
