import ast
from pathlib import Path

import pytest

from tests.architecture.sources import ROOT, modules, tree

RENDERING = {"integrator", "render", "render_tile", "rendering", "trace", "tracing"}


@pytest.fixture(autouse=True)
def _in_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize(
    "path", [m for m in modules() if m.parts[:3] == ("service", "api", "routes")], ids=str
)
def test_a_route_never_names_what_renders(path: Path) -> None:
    named = {
        node.attr
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "renderer"
    }
    imported = {
        alias.name
        for node in ast.walk(tree(path))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("renderer")
        for alias in node.names
    }
    assert not (named | imported) & RENDERING


def test_only_compile_decides_what_runs() -> None:
    """The loop over stages asks no question about effects."""
    questions = [
        node
        for node in ast.walk(tree(Path("renderer/integrator.py")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance"
    ]
    assert questions == []
