import ast
import re

import pytest

from tests.architecture.sources import ROOT, tree

LONGEST = {"A job": 25, "A ray": 20, "A target error": 15}
STOP = re.compile(r"^\| (\d+) \| `(.+?)` \| `(.+?)` \|", re.MULTILINE)
Named = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def walks() -> dict[str, list[tuple[str, str, str]]]:
    """The stops of each walk of the page: number, file and function."""
    page = (ROOT / "docs" / "explanation" / "architecture.md").read_text()
    parts = page.split("## A walk through the source")[1].split("\n## ")[0].split("\n### ")[1:]
    return {part.splitlines()[0].split(",")[0]: STOP.findall(part) for part in parts}


@pytest.mark.parametrize(("file", "function"), [stop[1:] for stops in walks().values() for stop in stops])
def test_a_stop_of_the_walk_is_a_function_of_its_file(file: str, function: str) -> None:
    body = tree(ROOT / file).body
    for name in function.split("."):
        (node,) = [node for node in body if isinstance(node, Named) and node.name == name]
        body = node.body


@pytest.mark.parametrize("name", LONGEST)
def test_a_walk_is_short_and_counts_its_stops(name: str) -> None:
    numbers = [int(number) for number, _, _ in walks()[name]]
    assert numbers == [*range(1, len(numbers) + 1)]
    assert 10 <= len(numbers) <= LONGEST[name]
