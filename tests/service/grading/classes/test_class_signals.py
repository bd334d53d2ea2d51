"""Students with the same files, and pictures with the same noise."""

import json
from typing import Any

import numpy as np
import pytest

from accuracy.comparison.inputs import picture_of
from renderer.images.colors import linear_from_srgb
from schemas.grading.classes import SharedFiles
from schemas.grading.grades import GradeInput
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import Manifest
from service.grading.classes.class_signals import shared_files, shared_noise
from service.grading.folders import Folder
from service.grading.grading import findings
from service.grading.likeness.fingerprints import Fingerprint, fingerprint
from service.grading.outcomes import of_picture
from service.grading.settings import Run
from tests.service.grading.assignments import (
    SCENE,
    Assignment,
    codes_of,
    image_test,
    npy,
    pixels,
    png,
    rays_test,
    scene,
)
from tests.service.grading.exports.samples import result, tried

CAMERA = SCENE["camera"] | {"width": 96, "height": 72}
HONEST = 12


def sampled(pattern: str, samples: int, seed: int = 0) -> dict[str, Any]:
    antialiasing = {"pattern": pattern, "samples": samples}
    return scene(camera=CAMERA, sampling={"antialiasing": antialiasing, "seed": seed})


def codes(document: dict[str, Any]) -> np.ndarray:
    return codes_of(pixels(document))


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    return pixels(sampled("uniform", 64))


@pytest.fixture(scope="module")
def prints(reference: np.ndarray) -> dict[str, dict[str, Fingerprint]]:
    """Honest students, two with one sample in the centre of pixels, and an altered copy of student 3."""
    drawn = {f"student-{seed:02}": codes(sampled("random", 16, seed)) for seed in range(HONEST)}
    drawn["fixed-1"] = drawn["fixed-2"] = codes(sampled("center", 1))
    drawn["copy"] = np.clip(np.round(1.03 * drawn["student-03"]), 0, 255).astype(np.uint8)
    wanted = picture_of(npy(reference), "reference.npy", "linear")
    return {student: {"picture": fingerprint(_seen(values), wanted)} for student, values in drawn.items()}


def _seen(values: np.ndarray) -> Any:
    return picture_of(png(values), "picture.png", "srgb")


def manifest(assignment: Assignment, reference: np.ndarray, **asked: Any) -> Manifest:
    """A test whose reference is a picture, unless something else is asked for."""
    np.save(assignment.references / "reference.npy", reference)
    (assignment.references / "lit.json").write_text(json.dumps(sampled("uniform", 64)))
    asked = {"type": "picture", "file": "reference.npy", "encoding": "linear"} | asked
    if asked["type"] == "scene":
        del asked["encoding"]
    return read_manifest(assignment.manifest(image_test(reference=asked)).read_bytes(), yaml=False)


@pytest.mark.parametrize("asked", [{"scene": "lit.json"}, {"type": "scene", "file": "lit.json"}])
def test_copy_is_found_and_a_fixed_pattern_is_not(
    assignment: Assignment,
    reference: np.ndarray,
    prints: dict[str, dict[str, Fingerprint]],
    asked: dict[str, Any],
) -> None:
    rendered = manifest(assignment, reference, **asked)
    (found,), left_out = shared_noise(rendered, assignment.references, prints, ())
    assert (found.students, found.tests) == (("copy", "student-03"), ("picture",))
    assert found.correlation > 0.9
    assert [each.students for each in left_out] == [("fixed-1", "fixed-2")]


def test_pictures_that_are_not_compared_are_named(
    assignment: Assignment, reference: np.ndarray, prints: dict[str, dict[str, Fingerprint]]
) -> None:
    asked = manifest(assignment, reference)
    loud = prints["student-00"]["picture"]
    loud = Fingerprint(detail=np.roll(loud.detail * 6, 7), rounding=loud.rounding)
    _, some = shared_noise(
        asked, assignment.references, prints | {"wrong": {}, "loud": {"picture": loud}}, ()
    )
    assert [(each.test, each.students) for each in some] == [("picture", ("wrong",)), ("picture", ("loud",))]
    few = {student: prints[student] for student in list(prints)[:9]}
    _, all_ = shared_noise(asked, assignment.references, few, ())
    assert [each.students for each in all_] == [tuple(few)]


def test_shared_files_are_not_reported_as_noise_too(
    assignment: Assignment, reference: np.ndarray, prints: dict[str, dict[str, Fingerprint]]
) -> None:
    same = SharedFiles(students=("fixed-1", "fixed-2", "zoe"), tests=("picture",))
    found, _ = shared_noise(manifest(assignment, reference), assignment.references, prints, [same])
    assert [shared.students for shared in found] == [("copy", "student-03")]


def filtered(linear: np.ndarray) -> np.ndarray:
    """A picture roughly as a filter of twice the width shows it."""
    for axis in (0, 1):
        linear = 0.75 * linear + 0.125 * (np.roll(linear, 1, axis) + np.roll(linear, -1, axis))
    return linear


def test_programs_of_the_same_filter_do_not_share_noise(
    assignment: Assignment, reference: np.ndarray, prints: dict[str, dict[str, Fingerprint]]
) -> None:
    asked = manifest(assignment, reference)
    wanted = picture_of(npy(reference), "reference.npy", "linear")
    smooth = {
        f"smooth-{seed}": {"picture": fingerprint(_seen(codes_of(filtered(drawn))), wanted)}
        for seed, drawn in ((seed, pixels(sampled("random", 16, seed))) for seed in range(50, 53))
    }
    honest = {name: found for name, found in prints.items() if name.startswith("student")}
    found, left_out = shared_noise(asked, assignment.references, honest | smooth, ())
    assert found == ()
    assert {student for each in left_out for student in each.students} <= {*smooth}


@pytest.mark.parametrize("flipped", [False, True])
def test_fingerprint_needs_a_picture_without_a_mistake(assignment: Assignment, flipped: bool) -> None:
    right = pixels(SCENE)
    assignment.hand_in("picture.npy", right[::-1] if flipped else right)
    asked = manifest(assignment, right)
    folders = Folder(assignment.references, "reference"), Folder(assignment.submission, "submission")
    (*_, outcome) = findings(asked.tests[0], Run(asked, *folders))
    assert outcome.fingerprint is None if flipped else not outcome.fingerprint.detail.any()


def read(test: str, digest: str, size: int | None = 3) -> GradeInput:
    return GradeInput(test=test, role="submission", name="p.png", sha256=digest, size=size)


def content(file: bytes, encoding: Any = "srgb") -> str | None:
    return of_picture("soft", "submission", picture_of(file, "p", encoding), len(file)).content


def test_content_is_that_of_pixels_in_any_file() -> None:
    codes = np.random.default_rng(1).integers(0, 256, (5, 7, 3), np.uint8)
    first = content(png(codes, compress_level=0))
    opaque = np.dstack((codes, np.full((5, 7), 255, np.uint8)))
    again = [
        content(png(codes, compress_level=9, optimize=True)),
        content(png(opaque)),
        content(npy(codes)),
        content(npy(codes.astype(np.uint16) * 257)),
        content(npy((codes / 255).astype(np.float32))),
        content(npy(linear_from_srgb(codes / 255).astype(np.float32)), "linear"),
    ]
    assert {first} == {*again}
    codes[2, 3, 1] ^= 1
    others = [content(png(codes)), content(png(codes.reshape(7, 5, 3)))]
    assert len({first, *others}) == 3


def test_content_of_hits_is_that_of_arrays(assignment: Assignment) -> None:
    file = assignment.hand_in("hits.npz", {"t": np.linspace(1, 2, 12), "shape": np.arange(12.0)})
    test = rays_test(rays={"type": "camera", "width": 4, "height": 3}, fields=["t", "shape"])
    (first,) = (read.content for read in assignment.grade(test).inputs if read.role == "submission")
    with np.load(file) as arrays:
        np.savez_compressed(file, **dict(reversed([*arrays.items()])))
    (again,) = (read.content for read in assignment.grade(test).inputs if read.role == "submission")
    assert first == again is not None


def test_shared_files_are_equal_files_of_a_test() -> None:
    same = [read("soft", "1"), read("phong", "2")]
    grades = {
        "a": result(tried(), inputs=same),
        "b": result(tried(), inputs=same),
        "c": result(tried(), inputs=[read("soft", "3"), read("phong", "4")]),
    }
    (shared,) = shared_files(grades)
    assert (shared.students, shared.tests) == (("a", "b"), ("phong", "soft"))


def test_shared_files_are_those_of_equal_content() -> None:
    files = {"a": ("1", "x"), "b": ("2", "x"), "c": ("1", "y")}
    grades = {
        student: result(tried(), inputs=[read("soft", digest).model_copy(update={"content": content})])
        for student, (digest, content) in files.items()
    }
    assert [shared.students for shared in shared_files(grades)] == [("a", "b")]


def test_rendered_pictures_are_no_shared_files() -> None:
    grades = {
        "a": result(tried(), inputs=[read("soft", "1", None), read("phong", "2")]),
        "b": result(tried(), inputs=[read("soft", "1", None), read("flat", "2")]),
    }
    assert shared_files(grades) == ()
