"""``penumbra handout``: every student gets the scenes that grading expects of them."""

from pathlib import Path
from typing import Any

import pytest

from schemas.grading.manifest_reading import read_manifest
from service.grading.variants import references_for
from tests.service.cli.conftest import Penumbra
from tests.service.grading.assignments import Assignment, image_test

RANGES = {"scenes": ["scene.json"], "secret": "autumn 2026", "turn": 10, "colors": 0.2}
WORDS = ("handout", "assignment/manifest.json", "-o", "out")


def made(folder: Path, **members: Any) -> Path:
    """An assignment, and a roster as Moodle exports it."""
    (folder / "roster.csv").write_text("Identifier,Grade\nParticipant 71,\nParticipant 72,\n")
    return Assignment.of(folder).manifest(image_test(), **members)


def test_scenes_are_those_that_grading_expects(here: Penumbra, tmp_path: Path) -> None:
    path = made(tmp_path, per_student=RANGES)
    assert here(*WORDS, "--student", "zoë", "--roster", "roster.csv").code == 0
    read = read_manifest(path.read_bytes(), yaml=False)
    found = {name: (tmp_path / "out" / name / "scene.json").read_bytes() for name in ("zoë", "71", "72")}
    assert found == {name: references_for(read, path.parent, name).read("scene.json") for name in found}
    assert len({*found.values()}) == 3


@pytest.mark.parametrize(
    ("words", "members", "code", "reported"),
    [
        (("--student", "a"), {}, 2, "has no per_student"),
        ((), {"per_student": RANGES}, 2, "--student or --roster"),
        (("--student", "../a"), {"per_student": RANGES}, 2, "'../a'"),
        (("--roster", "none.csv"), {"per_student": RANGES}, 3, "none.csv"),
    ],
)
def test_unusable_arguments(
    here: Penumbra, tmp_path: Path, words: tuple[str, ...], members: dict[str, Any], code: int, reported: str
) -> None:
    made(tmp_path, **members)
    outcome = here(*WORDS, *words)
    assert (outcome.code, outcome.out) == (code, "")
    assert reported in outcome.err
    assert not (tmp_path / "out").exists()
