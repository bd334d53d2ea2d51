"""Mistakes of whole programs that show in a picture of the ready assignment are named by it."""

import io
from pathlib import Path

import numpy as np
import pytest

import renderer
from accuracy.comparison import compare, picture_of
from scenes.make_assignment_parts import FOLDER
from schemas.grading.manifest_reading import read_manifest
from service.grading.folders import Folder
from service.grading.kinds import findings
from service.grading.mistakes.counterfactuals import explain
from service.grading.settings import Run
from tests.service.grading.assignment import program, submissions
from tests.service.grading.assignment.tracer import Tracer

MANIFEST = read_manifest((FOLDER / "manifest.yaml").read_bytes(), yaml=True)
TESTS = {test.id.replace("-", "_"): test for test in MANIFEST.tests}

SAMPLES = 4
"""Fewer than the assignment asks for: noise must not hide the mistake."""


@pytest.mark.parametrize(
    ("wrong", "name", "cause"),
    [
        ("shininess_doubled", "phong_highlights", "shininess"),
        ("specular_unclamped", "phong_highlights", "highlight_not_clamped"),
        ("normal_flipped", "phong_matte", "normals_flipped"),
        ("normal_flipped", "shadow_hard", "normals_flipped"),
        ("normals_not_normalised", "shadow_soft", "normals_not_normalised"),
        ("acne", "shadow_hard", "shadow_acne"),
        ("acne", "normal_map", "shadow_acne"),
        ("axes_not_unit", "camera_tilted", "camera_axes_not_unit"),
        ("axes_not_orthogonal", "camera_tilted", "camera_axes_not_orthogonal"),
        ("size_minus_one", "camera_straight", "size_minus_one"),
    ],
)
def test_a_mistake_of_a_program_is_named(
    wrong: str, name: str, cause: str, tmp_path: Path, keep: Path
) -> None:
    submissions.save(tmp_path, name, frozenset([wrong]), samples=SAMPLES)
    assert diagnosis(name, tmp_path, keep) == cause


def test_shared_light_points_are_named_with_random_places_in_pixels(tmp_path: Path, keep: Path) -> None:
    submissions.save(tmp_path, "shadow_soft", frozenset(["same_light_points"]))
    assert diagnosis("shadow_soft", tmp_path, keep) == "light_points_shared"


def test_a_mistake_that_another_explains_as_well_is_not_named(tmp_path: Path, keep: Path) -> None:
    """With flipped normals the sheet is as dark as without its only light."""
    submissions.save(tmp_path, "normal_map", frozenset(["normal_flipped"]), samples=SAMPLES)
    assert diagnosis("normal_map", tmp_path, keep) == ""


def test_the_last_shape_hit_is_named_where_it_is_not_the_nearest() -> None:
    """Floor and wall of the room come last and cover the others."""
    document = program.read(FOLDER, "shadow_hard")
    scene = renderer.load_scene(document)
    pictures = (
        Tracer(document, FOLDER, frozenset(["last_shape_wins"])).picture(SAMPLES),
        renderer.render(renderer.compile_scene(scene)).image,
    )
    found = compare(*(picture_of(saved(pixels), "picture.npy") for pixels in pictures))
    assert explain(scene, found)[0].cause == "last_hit_drawn"


def saved(pixels: np.ndarray) -> bytes:
    """An array as a file."""
    file = io.BytesIO()
    np.save(file, pixels.astype(np.float32))
    return file.getvalue()


def diagnosis(name: str, submission: Path, keep: Path) -> str:
    """The first cause; empty if there is none."""
    folders = Folder(FOLDER.resolve(), "reference"), Folder(submission.resolve(), "submission")
    run = Run(MANIFEST, *folders, keep=keep)
    *_, outcome = findings(TESTS[name], run)
    assert outcome.share < 1
    return outcome.diagnosis[0].cause if outcome.diagnosis else ""
