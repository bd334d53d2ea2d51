"""The mark in references that results show: copies have it, and no other picture."""

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison.heat import COLOR_STOPS, WHITE_DIFFERENCE, heat_map
from accuracy.comparison.inputs import Picture, picture_of
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from service.grading.likeness.marks import is_marked, marked
from tests.service.grading.assignments import SCENE, Assignment, image_test, npy, pixels, scene

WIDTH, HEIGHT, GAP = 96, 72, 4
TEST = image_test(
    submitted={"file": "picture.png", "encoding": "srgb"}, reference={"type": "scene", "file": "large.json"}
)


def sampled(seed: int, samples: int) -> dict[str, Any]:
    antialiasing = {"pattern": "random", "samples": samples}
    camera = SCENE["camera"] | {"width": WIDTH, "height": HEIGHT}
    return scene(camera=camera, sampling={"antialiasing": antialiasing, "seed": seed})


def png(codes: np.ndarray) -> bytes:
    file = io.BytesIO()
    Image.fromarray(np.clip(np.rint(codes), 0, 255).astype(np.uint8)).save(file, "PNG")
    return file.getvalue()


def seen(codes: np.ndarray) -> Picture:
    return picture_of(png(codes), "picture.png", "srgb")


def codes_of(linear: np.ndarray) -> np.ndarray:
    codes: np.ndarray = 255 * srgb_from_linear(np.clip(linear, 0, 1))
    return codes


@pytest.fixture(scope="module")
def reference() -> Picture:
    return picture_of(npy(pixels(sampled(0, 64))), "reference.npy", "linear")


@pytest.mark.slow
def test_reference_cut_out_of_a_result_is_signalled(assignment: Assignment) -> None:
    assignment.hand_in("../assignment/large.json", sampled(0, 64))
    assignment.hand_in("picture.png", png(codes_of(pixels(sampled(5, 16)))))
    found = assignment.run(TEST, pictures=True)
    (pair,) = (image.file for image in found.grade.tests[0].images if image.feedback == "picture")
    copy = np.asarray(Image.open(io.BytesIO(found.pictures[pair])), float)[:, WIDTH + GAP :][:, :WIDTH]
    around = [np.roll(copy, (down, right), (0, 1)) for down in (-1, 0, 1) for right in (-1, 0, 1)]
    noise = np.std(around, axis=0) * np.random.default_rng(1).standard_normal(copy.shape)
    assignment.hand_in("picture.png", png(copy + noise))
    codes = [[signal.code for signal in each.signals] for each in (found.grade, assignment.grade(TEST))]
    assert "marked_reference" not in codes[0]
    assert "marked_reference" in codes[1]


def test_reference_computed_from_maps_of_differences_is_marked(reference: Picture) -> None:
    # Maps show the channel that differs most: with grey pictures that is the only one.
    grey = picture_of(npy(reference.linear.mean(axis=2, keepdims=True).repeat(3, axis=2)), "grey", "linear")
    found = np.full((HEIGHT, WIDTH), np.nan)
    for code in (0, 60, 120, 180):
        flat = np.full(grey.linear.shape, linear_from_srgb(np.array(code / 255)))
        heat = heat_map(Picture.of_values(flat), marked(grey)).sum(axis=2)
        place = np.interp(heat, COLOR_STOPS.sum(axis=1), np.linspace(0, 1, len(COLOR_STOPS)))
        # What lies below this code is known already.
        found = np.where(np.isnan(found) & (place < 0.98), code + 255 * WHITE_DIFFERENCE * place, found)
    copy = found[:, :, None].repeat(3, axis=2)
    assert np.abs(copy - codes_of(grey.linear)).max() < 2
    assert is_marked(seen(copy), grey)


@pytest.mark.parametrize(
    "alter",
    [
        lambda codes: codes,
        lambda codes: 1.05 * codes,
        lambda codes: codes + np.random.default_rng(1).normal(0, 4, codes.shape),
        lambda codes: np.where(np.indices(codes.shape)[1] < WIDTH // 3, 255 - codes, codes),
    ],
    ids=["as it is", "brighter", "noisy", "a third replaced"],
)
def test_altered_copy_is_marked(reference: Picture, alter: Any) -> None:
    assert is_marked(seen(alter(codes_of(marked(reference).linear))), reference)


def test_pictures_of_other_programs_have_no_mark(reference: Picture) -> None:
    # One failure in a million pictures, whatever they show.
    for seed in range(1, 7):
        right = pixels(sampled(seed, 4))
        for picture in (codes_of(right), 255 * right, codes_of(right)[:, ::-1], 0 * right):
            assert not is_marked(seen(picture), reference)
    assert not is_marked(seen(codes_of(reference.linear)), reference)


def test_mark_follows_from_the_file_that_students_do_not_have(reference: Picture) -> None:
    values = reference.linear.astype(np.float32)
    values[0, 0, 0] += 2**-20
    guessed = picture_of(npy(values), "guessed.npy", "linear")
    shown = [seen(codes_of(marked(each).linear)) for each in (reference, guessed)]
    assert [is_marked(picture, reference) for picture in shown] == [True, False]
