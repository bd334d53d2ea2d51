import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.architecture.sources import ROOT, modules, python_files, tree

LONGEST_FILE = 400
LONGEST_FUNCTION = 60
NAMES_THAT_SAY_NOTHING = {"common", "helper", "helpers", "manager", "misc", "util", "utils"}


@pytest.mark.parametrize("path", python_files(), ids=str)
def test_a_file_fits_in_one_head(path: Path) -> None:
    assert len((ROOT / path).read_text().splitlines()) <= LONGEST_FILE


@pytest.mark.parametrize("path", python_files(), ids=str)
def test_a_file_is_named_after_what_it_does(path: Path) -> None:
    assert not {*path.parent.parts, path.stem} & NAMES_THAT_SAY_NOTHING


@pytest.mark.parametrize("path", modules(), ids=str)
def test_everything_public_has_a_docstring(path: Path) -> None:
    module = tree(path)
    bare = [name for name, node in _public("", module) if not ast.get_docstring(node)]
    assert bare == []


# A migration is a list of tables and columns, however long.
@pytest.mark.parametrize("path", [path for path in modules() if "migrations" not in path.parts], ids=str)
def test_a_function_fits_on_a_screen(path: Path) -> None:
    long = [
        node.name
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and _lines(node) > LONGEST_FUNCTION
    ]
    assert long == []


def _lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of the body without its docstring."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


Documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def _public(name: str, node: Documented) -> Iterator[tuple[str, Documented]]:
    yield name or "module", node
    for child in node.body if isinstance(node, ast.Module | ast.ClassDef) else []:
        if isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and not (
            child.name.startswith("_") or _is_overload(child)
        ):
            yield from _public(f"{name}.{child.name}".lstrip("."), child)


def _is_overload(node: ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return any(ast.unparse(decorator).endswith("overload") for decorator in node.decorator_list)
