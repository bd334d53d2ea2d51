from pathlib import Path

import numpy as np
import pytest

from benchmarks import references
from schemas.reading import read_scene
from schemas.scene import Scene

PROVENANCE = references.Provenance(
    renderer="none",
    command="none",
    date="2000-01-01",
    samples_per_pixel=1,
    own_error_255=0.0,
    scene_sha256="",
)


def soft() -> Scene:
    return read_scene((references.SCENES / "soft.json").read_bytes())[0]


def test_a_reference_comes_back_within_half_a_level_of_16_bits(tmp_path: Path) -> None:
    image = np.random.default_rng(1).random((5, 7, 3))
    references.save("noise", image, PROVENANCE, tmp_path)
    back, provenance = references.load("noise", tmp_path)
    assert back.shape == image.shape
    assert np.abs(back - image).max() <= 0.5 / 65535 * (1 + 1e-9)
    assert provenance == PROVENANCE


def test_what_lies_outside_0_to_1_is_kept_as_its_end(tmp_path: Path) -> None:
    references.save("ends", np.array([[[-1.0, 0.0, 7.0]]]), PROVENANCE, tmp_path)
    assert references.load("ends", tmp_path)[0].tolist() == [[[0.0, 0.0, 1.0]]]


def test_errors_are_those_of_clipped_values() -> None:
    image, converged = [[0.5, 3.0, -2.0]], [[0.5, 1.0, 0.0]]
    assert references.rmse_255(image, converged) == 0
    assert references.mean_difference_255(image, converged) == 0


def test_errors_are_in_units_of_a_display_level() -> None:
    assert references.rmse_255([0.0, 2 / 255], [0.0, 0.0]) == pytest.approx(2**0.5)
    assert references.mean_difference_255([0.0, 2 / 255], [0.0, 0.0]) == pytest.approx(1.0)


def test_the_digest_of_a_scene_changes_with_what_is_to_be_seen() -> None:
    scene = soft()
    dimmer = scene.model_copy(update={"ambient": (0.5, 0.5, 0.5)})
    assert references.scene_digest(dimmer) != references.scene_digest(scene)


def test_the_digest_of_a_scene_does_not_change_with_its_name_and_its_samples() -> None:
    scene = soft()
    other = scene.model_copy(update={"name": "hard", "sampling": type(scene.sampling)(seed=7)})
    assert references.scene_digest(other) == references.scene_digest(scene)
