"""Mistakes of a program are found in all its pictures together, alone and in products."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from accuracy.comparison import Picture
from accuracy.comparison.mistakes import CHANNELS, ENCODINGS, TRANSPOSED, TURNED
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from service.grading.programs.program import KINDS, MISTAKES, Pair, Program, ProgramMistake, encoded
from service.grading.programs.program_search import agree, shared

HEIGHT, WIDTH = 48, 64
FINE = 8
"""Parts of a pixel along each side."""

AMBIENT = 0.2
PICTURES = range(4)
TOLERANCE = 0.005
SLOW = pytest.mark.slow

Change = Callable[[np.ndarray], np.ndarray]


@cache
def parts(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Light and ambient term of every part of a pixel, and of one pixel around the picture, (.., .., 3)."""
    random = np.random.default_rng(number)
    y, x = np.mgrid[-FINE : (HEIGHT + 1) * FINE, -FINE : (WIDTH + 1) * FINE] / FINE
    color = np.full((*x.shape, 3), (0.15, 0.2, 0.3))
    for _ in range(12):
        middle, half = random.uniform(0, (WIDTH, HEIGHT)), random.uniform(3, 12, 2)
        inside = (np.abs(x - middle[0]) < half[0]) & (np.abs(y - middle[1]) < half[1])
        color[inside] = random.uniform(0.05, 0.75, 3)
    shade = 0.6 + 0.4 * np.sin(x / 9 + number) * np.cos(y / 7)
    ambient = AMBIENT * color if number % 2 else np.zeros_like(color)
    return color * shade[:, :, None], ambient


def window(fine: np.ndarray, right: int = 0, down: int = 0, origin: float | None = None) -> np.ndarray:
    """The parts of each pixel, (H, W, parts, 3), of a picture that lies so many parts too far.

    With an `origin` it is stretched from there: places are divided by a pixel too few.
    """
    rows, columns = (_places(length, moved, origin) for length, moved in ((HEIGHT, down), (WIDTH, right)))
    whole = fine[rows[:, None], columns].reshape(HEIGHT, FINE, WIDTH, FINE, 3).swapaxes(1, 2)
    return whole.reshape(HEIGHT, WIDTH, FINE * FINE, 3)


def _places(length: int, moved: int, origin: float | None) -> np.ndarray:
    """Indices of the parts that a side of so many pixels shows."""
    places = np.arange(length * FINE) + 0.5
    if origin is not None:
        places = (places - origin * FINE) * (length / (length - 1))
    return np.floor(FINE + places - moved).astype(np.intp)


def sampled(fine: np.ndarray, samples: int, seed: int) -> np.ndarray:
    """Means of random parts of each pixel, as a simple program takes them."""
    random = np.random.default_rng(seed)
    chosen = random.integers(fine.shape[2], size=(HEIGHT, WIDTH, samples))
    rows, columns = np.ogrid[:HEIGHT, :WIDTH]
    return fine[rows[..., None], columns[..., None], chosen].mean(axis=2)


def codes(linear: np.ndarray) -> np.ndarray:
    """Linear values after they were stored with 8 bits as sRGB."""
    stored = np.round(255 * srgb_from_linear(np.clip(linear, 0, 1))) / 255
    return linear_from_srgb(stored).astype(np.float64)


def pairs(
    samples: int = 16,
    seed: int = 0,
    *,
    light: float = 1.0,
    ambient: bool = True,
    right: int = 0,
    down: int = 0,
    origin: float | None = None,
    after: Change = lambda picture: picture,
) -> list[Pair]:
    """Pictures of a program, with their references."""
    made = []
    for number in PICTURES:
        direct, surrounding = parts(number)
        reference = np.clip(window(direct + surrounding).mean(axis=2), 0, 1)
        shown = direct + surrounding if ambient else direct
        linear = np.clip(
            light * sampled(window(shown, right, down, origin), samples, 100 * seed + number), 0, 1
        )
        allowed = np.full_like(reference, TOLERANCE)
        made.append(Pair(codes(after(linear)), reference, allowed, window(surrounding).mean(axis=2)))
    return made


def causes(found: list[Pair]) -> set[str]:
    pictures = [(Picture.of_values(pair.image), Picture.of_values(pair.reference)) for pair in found]
    assert not all(agree(*both, TOLERANCE) for both in pictures)
    return {mistake.cause for mistake in mistakes(found)}


def mistakes(found: list[Pair]) -> tuple[ProgramMistake, ...]:
    return shared({str(number): pair for number, pair in enumerate(found)}, KINDS).found


MADE: dict[str, dict[str, object]] = {
    "flipped_vertically": {"after": lambda picture: picture[::-1]},
    "turned_half": {"after": lambda picture: picture[::-1, ::-1]},
    "channels_bgr": {"after": lambda picture: picture[:, :, ::-1]},
    "gamma_missing": {"after": linear_from_srgb},
    "gamma_twice": {"after": srgb_from_linear},
    "gamma_2.2": {"after": lambda picture: linear_from_srgb(picture ** (1 / 2.2))},
    "tone_mapped_reinhard": {"after": lambda linear: linear / (1 + linear)},
    "tone_mapped_luminance": {
        "after": lambda linear: linear / (1 + linear @ [0.2126, 0.7152, 0.0722])[..., None]
    },
    "tone_mapped_exponential": {"after": lambda linear: 1 - np.exp(-linear)},
    "exposure": {"light": 1.1},
    "ambient_missing": {"ambient": False},
    "half_pixel_right_down": {"right": 4, "down": 4},
    "half_pixel_up": {"down": -4},
    "one_pixel_left": {"right": -8},
}
"""Programs by the cause that names their mistake."""

PRODUCTS = (
    ("flipped_vertically", "gamma_missing"),
    ("channels_bgr", "half_pixel_right_down"),
    ("exposure", "ambient_missing"),
    ("gamma_twice", "one_pixel_left"),
    ("exposure", "half_pixel_up"),
    ("ambient_missing", "turned_half"),
)


@pytest.mark.parametrize("cause", MADE)
def test_mistake_in_all_pictures_is_found(cause: str) -> None:
    assert causes(pairs(4, **MADE[cause])) == {cause}  # type: ignore[arg-type]


@pytest.mark.parametrize("origin", [0.0, 0.5])
def test_division_by_a_pixel_too_few_is_found(origin: float) -> None:
    (found,) = mistakes(pairs(origin=origin))
    assert (found.cause, len(found.shows)) == ("size_minus_one", len(PICTURES))


@pytest.mark.parametrize("both", PRODUCTS, ids=" and ".join)
def test_two_mistakes_at_once_are_found(both: tuple[str, str]) -> None:
    steps = [MADE[cause]["after"] for cause in both if "after" in MADE[cause]]

    def after(picture: np.ndarray) -> np.ndarray:
        for step in steps:
            picture = step(picture)  # type: ignore[operator]
        return picture

    changes = MADE[both[0]] | MADE[both[1]] | {"after": after}
    assert causes(pairs(**changes)) == set(both)  # type: ignore[arg-type]


def nine(pair: Pair) -> Pair:
    """A picture three times as wide and high, whose search looks at some of its pixels."""
    parts = (pair.image, pair.reference, pair.allowed, pair.ambient)
    return Pair(*(np.tile(part, (3, 3, 1)) for part in parts if part is not None))


@pytest.mark.parametrize("both", PRODUCTS[2:5], ids=" and ".join)
def test_large_pictures_show_the_same_mistakes(both: tuple[str, str]) -> None:
    changes = MADE[both[0]] | MADE[both[1]]
    assert causes([nine(pair) for pair in pairs(**changes)]) == set(both)  # type: ignore[arg-type]


@pytest.mark.parametrize("seeds", [2, pytest.param(10, marks=SLOW)])
def test_right_program_has_no_mistakes(seeds: int) -> None:
    """If one right program in ten were accused, one of 23 trials of 30 programs would pass."""
    for samples in (4, 16, 64):
        assert [mistakes(pairs(samples, seed)) for seed in range(seeds)] == [()] * seeds


def test_mistake_in_one_picture_is_none_of_the_program() -> None:
    right, turned = pairs(), pairs(after=lambda picture: picture[::-1])
    assert causes([turned[0], *right[1:]]) == set()


def test_another_wrong_picture_hides_no_mistake() -> None:
    turned = pairs(after=lambda picture: picture[::-1])
    other = Pair(1 - turned[0].image, *(getattr(turned[0], name) for name in ("reference", "allowed")))
    (found,) = mistakes([other, *turned[1:]])
    assert (found.cause, found.shows | {"0"}) == ("flipped_vertically", {"0", "1", "2", "3"})


@pytest.mark.parametrize("corner", [False, True])
def test_single_sample_is_missing_antialiasing(corner: bool) -> None:
    place = 0 if corner else FINE * FINE // 2 + FINE // 2
    made = []
    for number in PICTURES:
        fine = window(sum(parts(number)))  # type: ignore[arg-type]
        reference = fine.mean(axis=2)
        made.append(Pair(codes(fine[:, :, place]), reference, np.full_like(reference, TOLERANCE)))
    (found,) = mistakes(made)
    assert found.cause == "antialiasing_missing"
    assert ("corner" in found.hint) == corner


@pytest.mark.parametrize("mistake", [*ENCODINGS, *CHANNELS, *TURNED, TRANSPOSED], ids=lambda one: one.cause)
def test_undone_mistake_gives_the_right_picture(mistake: object) -> None:
    random = np.random.default_rng(0)
    right = random.uniform(0.01, 1, (12, 12, 3))
    cause: str = mistake.cause  # type: ignore[attr-defined]
    kind = "encoding" if mistake in ENCODINGS else "channels" if mistake in CHANNELS else "orientation"
    program = Program(**{kind: cause})  # type: ignore[arg-type]
    wrong = encoded(program.encoding, right)
    for _ in range({"channels_gbr": 2, "channels_brg": 2}.get(cause, 1)):
        # Orders of three return after three steps, all others after two.
        wrong = wrong if kind == "encoding" else MISTAKES[cause].undo(wrong)
    # A table of 2**13 entries, and float32.
    np.testing.assert_allclose(program.undone(wrong, right, None), right, atol=1e-3)
