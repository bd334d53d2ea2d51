import ast
import re
import tomllib
from collections.abc import Iterator
from fnmatch import fnmatch

from tests.architecture.sources import ROOT, modules, python_files, tree

LONGEST_FILE = 400
LONGEST_FUNCTION = 60
NAMES_THAT_SAY_NOTHING = {"common", "helper", "helpers", "manager", "misc", "util", "utils"}


def test_a_file_fits_in_one_head() -> None:
    assert [
        path for path in python_files() if len((ROOT / path).read_text().splitlines()) > LONGEST_FILE
    ] == []


def test_a_file_is_named_after_what_it_does() -> None:
    assert [path for path in python_files() if {*path.parent.parts, path.stem} & NAMES_THAT_SAY_NOTHING] == []


def test_everything_public_has_a_docstring() -> None:
    assert [
        (path, name)
        for path in modules()
        for name, node in _public("", tree(path))
        if not ast.get_docstring(node)
    ] == []


def test_every_example_in_a_docstring_is_run() -> None:
    options = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["pytest"]["ini_options"]
    ignored = [word.partition("=")[2] for word in options["addopts"] if word.startswith("--ignore-glob=")]
    examples = [path for path in modules() if re.search(r"^ *>>> ", (ROOT / path).read_text(), re.MULTILINE)]
    assert len(examples) > 40
    assert [
        path
        for path in examples
        if path.parts[0] not in options["testpaths"] or any(fnmatch(str(ROOT / path), one) for one in ignored)
    ] == []


def test_a_function_fits_on_a_screen() -> None:
    # A migration is a list of tables and columns, however long.
    assert [
        (path, node.name)
        for path in modules()
        if "migrations" not in path.parts
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and _lines(node) > LONGEST_FUNCTION
    ] == []


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
