"""Tests of the kinds `image` and `scene`: points and messages."""

import io
import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import compare, picture_of
from renderer.images.exr import encode_exr
from tests.service.grading.assignments import (
    SCENE,
    Assignment,
    codes_of,
    image_test,
    pixels,
    png,
    scene,
    scene_test,
)

RIGHT = pixels(SCENE)
GREY = {"type": "picture", "file": "grey.npy", "encoding": "linear"}


def grey(value: float) -> np.ndarray:
    return np.full((32, 48, 3), value, np.float32)


def graded(assignment: Assignment, picture: Any, **changes: Any) -> Any:
    assignment.hand_in("picture.npy", picture)
    return assignment.test(image_test(**changes))


def test_equal_picture_matches_and_earns_all(assignment: Assignment) -> None:
    assignment.hand_in("picture.npy", RIGHT)
    made = assignment.run(image_test(), pictures=True)
    found = made.grade
    assert (found.verdict, found.score, found.max_score) == ("match", 10, 10)
    assert found.tests[0].status == "passed"
    submitted, reference = found.inputs
    assert (submitted.role, submitted.name, submitted.encoding) == ("submission", "picture.npy", "linear")
    assert submitted.size == (assignment.submission / "picture.npy").stat().st_size
    assert (reference.role, reference.name, reference.size) == ("reference", "scene.json", None)
    shown, _ = found.tests[0].images
    with Image.open(io.BytesIO(made.pictures[shown.file])) as image:
        assert image.size == (3 * 48 + 8, 32)


def test_encoding_is_that_of_the_manifest(assignment: Assignment) -> None:
    assignment.hand_in("picture.png", png(codes_of(RIGHT)))
    stated = {"submitted": {"file": "picture.png", "encoding": "srgb"}}
    assert assignment.test(image_test(**stated)).verdict == "match"
    stated["submitted"]["encoding"] = "linear"
    tested = assignment.test(image_test(**stated))
    assert (tested.verdict, tested.points) == ("mismatch", 0)
    assert tested.diagnosis[0].cause == "gamma_twice"


def test_mistake_is_reported_with_the_advice(assignment: Assignment) -> None:
    tested = graded(assignment, RIGHT[::-1], advice="See lecture 2.")
    assert tested.status == "failed"
    assert tested.diagnosis[0].cause == "flipped_vertically"
    assert tested.message.endswith("See lecture 2.")


@pytest.mark.parametrize(
    ("accept", "points"),
    [
        # Everywhere 0.25 apart: rmse is 0.25, and every block is biased.
        ({"by": "metric", "metric": "rmse", "full": 0.25}, Fraction(10)),
        ({"by": "metric", "metric": "rmse", "full": 0.125, "zero": 0.625}, Fraction(15, 2)),
        (
            {"by": "metric", "metric": "max_abs", "full": 0.125, "bands": [{"at": 0.25, "share": 0.25}]},
            Fraction(5, 2),
        ),
        ({"by": "metric", "metric": "mse", "full": 0.0625}, Fraction(10)),
        ({"by": "metric", "metric": "frac_over", "full": 0.5, "limit": 0.25}, Fraction(10)),
        ({"by": "metric", "metric": "frac_over", "full": 0.5, "limit": 0.125}, Fraction(0)),
        ({"by": "error", "full": 0.25}, Fraction(10)),
        ({"by": "verdict", "zero": 1.0}, Fraction(0)),
    ],
    ids=str,
)
def test_points_follow_from_the_metric(
    assignment: Assignment, accept: dict[str, object], points: Fraction
) -> None:
    np.save(assignment.references / "grey.npy", grey(0.5))
    assert Fraction(graded(assignment, grey(0.25), reference=GREY, accept=accept).points) == points


def test_half_of_the_blocks_earn_half(assignment: Assignment) -> None:
    np.save(assignment.references / "grey.npy", grey(0.5))
    half = grey(0.5)
    half[:, :24] = 0.25
    accept = {"by": "verdict", "full": 0.25, "zero": 0.75}
    found = graded(assignment, half, reference=GREY, accept=accept)
    assert found.value == 0.5
    assert Fraction(found.points) == 5
    assert (found.status, found.verdict) == ("partial", "mismatch")
    tolerant = graded(assignment, half, reference=GREY, accept=accept | {"tolerance": 0.25})
    assert (tolerant.status, tolerant.verdict) == ("passed", "noisy_match")


def test_region_alone_counts(assignment: Assignment) -> None:
    wrong = RIGHT.copy()
    wrong[16:24, 8:16] = 1 - np.round(wrong[16:24, 8:16])
    assignment.hand_in("picture.npy", wrong)
    beside = assignment.test(image_test(region=[24, 0, 48, 32]))
    assert (beside.status, beside.verdict) == ("passed", "match")
    inside = assignment.test(image_test(region=[8, 8, 24, 32]))
    assert inside.status == "failed"
    # One of the six blocks of the region.
    assert inside.value == pytest.approx(1 / 6)
    place = inside.worst_regions[0]
    assert (place.x0, place.y0, place.x1, place.y1) == (8, 16, 16, 24)


def test_mask_alone_counts(assignment: Assignment) -> None:
    wrong = RIGHT.copy()
    wrong[4, 4] += 0.5
    assignment.hand_in("picture.npy", wrong)
    mask = np.zeros((32, 48), np.uint8)
    mask[4, 5:9] = 255
    Image.fromarray(mask).save(assignment.references / "mask.png")
    by_largest = {"by": "metric", "metric": "max_abs", "full": 0.25}
    assert assignment.test(image_test(mask="mask.png", accept=by_largest)).metrics["max_abs"] == 0
    mask[4, 4] = 255
    Image.fromarray(mask).save(assignment.references / "mask.png")
    # One of five pixels that count is off by a half, all channels alike.
    found = assignment.test(
        image_test(mask="mask.png", accept={"by": "metric", "metric": "mse", "full": 0.01})
    )
    assert found.value == pytest.approx(0.25 / 5, rel=1e-6)
    assert found.status == "failed"


def test_forgiven_mistake_costs_nothing_and_hides_no_other(assignment: Assignment) -> None:
    accept = {"by": "verdict", "forgiven": ["flipped_vertically"]}
    assignment.hand_in("picture.npy", RIGHT[::-1])
    assert assignment.test(image_test()).status == "failed"
    forgiven = assignment.test(image_test(accept=accept))
    assert forgiven.status == "passed"
    assert "flipped_vertically" in forgiven.message
    missing = pixels(scene(lights=[]))
    assignment.hand_in("picture.npy", missing[::-1])
    assert assignment.test(image_test(accept=accept)).status == "failed"


def test_diagnosed_mistake_may_keep_a_share(assignment: Assignment) -> None:
    assignment.hand_in("picture.npy", RIGHT[::-1])
    found = assignment.test(image_test(accept={"by": "verdict", "diagnosed": 0.5}))
    assert (found.points, found.status) == (5, "partial")


def header(write: Callable[[io.BytesIO], object]) -> bytes:
    """The first bytes of a file, too few to be decoded."""
    file = io.BytesIO()
    write(file)
    return file.getvalue()[:150]


@pytest.mark.parametrize(
    "content",
    [
        header(lambda file: Image.new("RGB", (3840, 2160)).save(file, "png")),
        header(lambda file: np.save(file, np.zeros((2160, 3840, 3), np.float32))),
    ],
    ids=["png", "npy"],
)
def test_picture_of_another_size_is_refused_before_it_is_decoded(
    assignment: Assignment, content: bytes
) -> None:
    assignment.hand_in("picture.npy", content)
    tested = assignment.test(image_test())
    assert (tested.status, tested.points) == ("not_gradable", 0)
    assert "picture.npy is 3840 x 2160 pixels, not 48 x 32" in tested.message


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (np.full((32, 48, 3), np.nan, np.float32), "NaN"),
        (b"no picture", "picture.npy"),
        (np.zeros((32, 48, 7), np.float32), "picture.npy"),
    ],
    ids=["nan", "unreadable", "channels"],
)
def test_unusable_picture_is_not_gradable_and_not_zero(
    assignment: Assignment, content: object, said: str
) -> None:
    assignment.hand_in("picture.npy", content)
    found = assignment.grade(image_test())
    tested = found.tests[0]
    assert (tested.status, tested.verdict) == ("not_gradable", "not_comparable")
    assert said in tested.message
    assert (found.gradable, found.verdict, found.ungraded) == (False, "not_comparable", ("picture",))


def test_missing_extra_is_no_fault_of_a_submission(
    assignment: Assignment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assignment.hand_in("picture.exr", encode_exr(RIGHT))
    # Tests of an assignment run in processes of their own.
    (tmp_path / "OpenEXR.py").write_text("raise ImportError")
    monkeypatch.syspath_prepend(tmp_path)
    tested = assignment.test(image_test(submitted={"file": "picture.exr", "encoding": "linear"}))
    assert tested.status == "error"
    assert "penumbra-render[exr]" in tested.message


def test_noise_layers_of_a_submission_are_ignored(assignment: Assignment) -> None:
    claim = {"error": np.full((32, 48, 3), 9, np.float32), "samples": np.full((32, 48), 4, np.int32)}
    wrong = encode_exr(pixels(scene(shapes=SCENE["shapes"][:1])), claim)
    assignment.hand_in("picture.exr", wrong)
    noisy = scene(sampling={"antialiasing": {"pattern": "random", "samples": 4}})
    (assignment.references / "scene.json").write_text(json.dumps(noisy))
    tested = assignment.test(image_test(submitted={"file": "picture.exr", "encoding": "linear"}))
    assert (tested.status, tested.verdict) == ("failed", "mismatch")
    # With its own noise estimate, no difference would exceed the noise.
    assert compare(picture_of(wrong, "wrong"), picture_of(encode_exr(pixels(noisy), claim), "right")).passed


def test_noise_of_the_reference_is_no_error(assignment: Assignment) -> None:
    # The reference is off by 1/8 everywhere and says so, so no error remains for the submission.
    np.save(assignment.references / "grey.npy", grey(0.5))
    np.save(assignment.references / "grey.npy.error.npy", grey(0.125))
    found = graded(assignment, grey(0.375), reference=GREY, accept={"by": "error", "full": 0.0})
    assert (found.value, found.status) == (0, "passed")
    assert found.metrics["rmse"] == 0.125


def test_submitted_scene_is_rendered_and_compared(assignment: Assignment) -> None:
    assert assignment.test(scene_test()).verdict == "match"
    assignment.hand_in("scene.json", scene(shapes=SCENE["shapes"][:1]))
    tested = assignment.test(scene_test())
    assert (tested.status, tested.worst_regions[0].name) == ("failed", "ball (shapes/1)")


def test_invalid_scene_is_reported_with_its_pointers(assignment: Assignment) -> None:
    assignment.hand_in("scene.json", scene(shapes=[{"type": "ellipsoid"}]))
    tested = assignment.test(scene_test())
    assert tested.status == "not_gradable"
    assert "/shapes/0" in tested.message


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"region": [0, 0, 48, 33]}, "reaches beyond"),
        ({"mask": "small.png"}, "has 8 x 8"),
        ({"mask": "black.png"}, "is black"),
        ({"mask": "none.png"}, "none.png is not beside the manifest"),
        ({"region": [0, 0, 8, 8], "accept": {"by": "metric", "metric": "ssim", "full": 0.9}}, "11 x 11"),
        ({"reference": GREY | {"file": "small.png", "encoding": "srgb", "scene": "scene.json"}}, "48 x 32"),
        ({"reference": {"type": "scene", "file": "broken.json"}}, "/shapes/0"),
    ],
    ids=["region", "mask", "black", "missing", "ssim", "scene", "broken"],
)
def test_impossible_manifest_costs_no_points(
    assignment: Assignment, changes: dict[str, object], said: str
) -> None:
    Image.fromarray(np.full((8, 8), 255, np.uint8)).save(assignment.references / "small.png")
    Image.fromarray(np.zeros((32, 48), np.uint8)).save(assignment.references / "black.png")
    broken = scene(shapes=[{"type": "ellipsoid"}])
    (assignment.references / "broken.json").write_text(json.dumps(broken))
    assignment.hand_in("picture.npy", RIGHT)
    tested = assignment.test(image_test(**changes))
    assert tested.status == "error"
    assert said in tested.message
