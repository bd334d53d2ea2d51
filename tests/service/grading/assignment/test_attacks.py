"""Noise, blurs, filters and copies in the ready assignment: what they earn, and signals for staff."""

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison.blurs import smoothed
from scenes.make_assignment_parts import FOLDER
from service.grading.outcomes import Outcome
from tests.service.grading.assignment.test_assignment import TESTS, findings, run_of
from tests.service.grading.assignment.tracer import Array, Tracer, encoded, read

Added = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def blue(picture: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Noise whose means over blocks are near 0."""
    white = random.standard_normal(picture.shape)
    around = sum(np.roll(white, step, axis) for step in (1, -1) for axis in (0, 1)) / 4
    return picture + 0.1 * (white - around) / 1.25**0.5


def salted(picture: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """An eighth of the pixels black, and as many white."""
    drawn = random.random(picture.shape[:2])[:, :, None]
    return np.where(drawn < 0.125, 0.0, np.where(drawn < 0.25, 1.0, picture))


NOISE: dict[str, Added] = {
    "Gaussian": lambda picture, random: picture + 0.05 * random.standard_normal(picture.shape),
    "uniform": lambda picture, random: picture + random.uniform(-0.17, 0.17, picture.shape),
    "multiplied": lambda picture, random: picture * (1 + 0.3 * random.standard_normal(picture.shape)),
    "blue": blue,
    "salt and pepper": salted,
}


def drawn(name: str, *wrong: str) -> np.ndarray:
    return Tracer(read(FOLDER, name), FOLDER, frozenset(wrong)).picture()


def graded(name: str, codes: np.ndarray, folder: Path) -> Outcome:
    """Points of a picture before its mistakes are reproduced with the scene."""
    Image.fromarray(codes).save(folder / f"{name}.png")
    return next(iter(findings(TESTS[name], run_of(folder, folder))))


def explained(name: str, codes: np.ndarray, folder: Path) -> Outcome:
    """Points of a picture, with their cause."""
    Image.fromarray(codes).save(folder / f"{name}.png")
    *_, outcome = findings(TESTS[name], run_of(folder, folder))
    return outcome


def codes_of(outcome: Outcome) -> set[str]:
    return {signal.code for signal in outcome.signals}


@pytest.fixture(scope="module")
def wrong() -> np.ndarray:
    return drawn("phong_matte", "no_ambient")


@pytest.mark.parametrize("kind", NOISE)
def test_noise_buys_no_points(kind: str, wrong: np.ndarray, tmp_path: Path) -> None:
    noisy = NOISE[kind](wrong, np.random.default_rng(1))
    outcome = graded("phong_matte", encoded(noisy), tmp_path)
    assert outcome.share == 0
    assert "noise_without_samples" in codes_of(outcome)


def test_blur_is_no_antialiasing(tmp_path: Path) -> None:
    blurred = smoothed(drawn("antialiasing", "one_sample"), 0.8)
    assert graded("antialiasing", encoded(blurred), tmp_path).share == 0


@pytest.mark.parametrize("name", ["shadow_hard", "antialiasing"])
def test_pixel_filter_costs_points_where_antialiasing_is_graded(name: str, tmp_path: Path) -> None:
    picture = Tracer(read(FOLDER, name), FOLDER).picture(4, "tent")
    outcome = explained(name, encoded(picture), tmp_path)
    assert outcome.share == (0 if name == "antialiasing" else 1)
    assert "pixel_filter" in outcome.message


def stored(picture: np.ndarray, form: str, **options: int) -> np.ndarray:
    file = io.BytesIO()
    Image.fromarray(encoded(picture)).save(file, form, **options)
    return np.asarray(Image.open(file).convert("RGB"))


def as_jpeg(picture: np.ndarray, quality: int = 95) -> np.ndarray:
    return stored(picture, "JPEG", quality=quality)


@pytest.mark.parametrize(
    ("name", "mistake", "quality", "share"),
    [
        ("phong_matte", "no_ambient", 95, 0),
        ("shadow_hard", "", 75, 1),
        ("shadow_soft", "", 75, 1),
        ("shadow_soft", "hard_shadow", 75, 0),
        ("shadow_soft", "no_max", 95, 0),
    ],
)
def test_jpeg_hides_no_mistake_and_costs_nothing_by_itself(
    name: str, mistake: str, quality: int, share: float, tmp_path: Path
) -> None:
    outcome = graded(name, as_jpeg(drawn(name, mistake), quality), tmp_path)
    assert outcome.share == share
    assert mistake or "lossy_compression" in outcome.message


@pytest.mark.slow
@pytest.mark.parametrize("name", ["antialiasing", "antialiasing_advanced"])
def test_jpeg_is_named_where_its_noise_costs_points(name: str, tmp_path: Path) -> None:
    outcome = explained(name, as_jpeg(drawn(name)), tmp_path)
    assert outcome.share == 0
    assert [cause.cause for cause in outcome.diagnosis] == ["lossy_compression"]


@pytest.mark.parametrize(
    ("name", "form", "cause"),
    [
        ("phong_highlights", "GIF", "palette"),
        ("phong_highlights", "WEBP", "lossy_compression"),
        ("shadow_soft", "WEBP", "lossy_compression"),
        ("shadow_soft", "JPEG", "lossy_compression"),
        ("shadow_hard", "JPEG", "lossy_compression"),
    ],
)
def test_lossy_format_is_named_though_it_cannot_be_undone(
    name: str, form: str, cause: str, tmp_path: Path
) -> None:
    quality = {"quality": 50} if form != "GIF" else {}
    outcome = explained(name, stored(drawn(name), form, **quality), tmp_path)
    assert outcome.share == 0
    assert [each.cause for each in outcome.diagnosis] == [cause]
    assert "noisier than 4 samples" not in outcome.message


@pytest.mark.parametrize("form", ["GIF", "JPEG"])
def test_named_format_earns_nothing(form: str, tmp_path: Path) -> None:
    """A test that gives half of its points for one mistake gives none for a format that hides others."""
    quality = {"quality": 50} if form == "JPEG" else {}
    codes, test = stored(drawn("phong_highlights", "no_ambient"), form, **quality), TESTS["phong_highlights"]
    Image.fromarray(codes).save(tmp_path / "phong_highlights.png")
    lenient = test.model_copy(update={"accept": test.accept.model_copy(update={"diagnosed": 0.5})})
    outcome = next(iter(findings(lenient, run_of(tmp_path, tmp_path))))
    assert (outcome.share, outcome.metric) == (0, "bias_blocks")


def test_too_noisy_jpeg_is_not_said_to_cost_nothing(tmp_path: Path) -> None:
    outcome = graded("shadow_hard", as_jpeg(drawn("shadow_hard"), 50), tmp_path)
    assert outcome.share == 0
    assert "costs no points" not in outcome.message


class Encoding(Tracer):
    """A tracer that takes the mean of encoded samples."""

    def colors(self, origins: Array, directions: Array) -> Array:
        return np.clip(super().colors(origins, directions), 0, 1) ** (1 / 2.4)

    def picture(self, samples: int = 16, pattern: str = "random") -> Array:
        return super().picture(samples, pattern) ** 2.4


@pytest.mark.parametrize(
    ("name", "mistake", "share"),
    [
        ("shadow_soft", "", 1),
        ("shadow_soft", "no_ambient", 0),
        pytest.param("antialiasing", "", 0, marks=pytest.mark.slow),
    ],
)
def test_averages_of_encoded_samples_cost_points_where_antialiasing_is_graded(
    name: str, mistake: str, share: float, tmp_path: Path
) -> None:
    picture = Encoding(read(FOLDER, name), FOLDER, frozenset([mistake])).picture()
    outcome = (graded if mistake else explained)(name, encoded(picture), tmp_path)
    assert outcome.share == share
    assert mistake or "averaged_after_encoding" in outcome.message


@pytest.mark.parametrize("deviation", [0, 1, 2, 4])
def test_copy_with_a_little_noise_gives_a_signal(deviation: int, tmp_path: Path) -> None:
    with np.load(FOLDER / "references" / "antialiasing.npz") as kept:
        codes = encoded(kept["image"].astype(np.float64)).astype(np.float64)
    copy = np.rint(codes + deviation * np.random.default_rng(deviation).standard_normal(codes.shape))
    assert codes_of(graded("antialiasing", np.clip(copy, 0, 255).astype(np.uint8), tmp_path))


@pytest.mark.parametrize("name", ["phong_matte", "shadow_soft"])
def test_honest_picture_gives_no_signal(name: str, tmp_path: Path) -> None:
    outcome = graded(name, encoded(drawn(name)), tmp_path)
    assert (outcome.share, codes_of(outcome)) == (1, set())
