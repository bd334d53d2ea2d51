"""Sums of a million samples, and from radiance to the codes of a picture file."""

import io
import math

import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.film import Film, compose
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.images.files import displayed, encode_png
from renderer.math.numerics import halving_sum
from renderer.tiling import passes
from schemas.scene import Display
from schemas.tiles import Tile
from tests.documents import camera, phong, rectangle, scene
from tests.numerics.tracing import EPS, mp
from tests.pictures.parts import plan_of

Floats = np.ndarray


def brightnesses(count: int, seed: int) -> Floats:
    """Samples (3, count): all the same, at random, and one bright one before many dark ones."""
    drawn = np.random.default_rng(seed)
    last = np.full(count, drawn.random() / 1000)
    last[0] = 1e6
    return np.array([np.full(count, drawn.integers(1, 10) / 10), drawn.random(count), last])


def test_sum_of_a_million_has_12_digits() -> None:
    samples = brightnesses(1_000_000, seed=0)
    true = np.array([math.fsum(row) for row in samples])
    assert np.abs(halving_sum(samples.T.copy()) / true - 1).max() <= 1e-12


@pytest.mark.parametrize("count", [1, 5, 64, 4096])
def test_pixel_is_the_mean_of_its_samples(count: int) -> None:
    samples, zero, parts = brightnesses(count, seed=count), np.zeros(1, dtype=np.int64), []
    for pass_ in passes(1, 1, count)[1:]:
        film = Film(Tile(0, 0, 0, 1, 1), pass_)
        film.add(zero, zero, samples[:, pass_.first : pass_.last].copy())
        parts.append((pass_, film.image()))
    true = np.array([math.fsum(row) / count for row in samples])
    assert np.abs(compose(parts)[0, 0] / true - 1).max() <= 2.0**-23


TOE = 0.0031308
"""The branches part at the double nearest to it."""


def curve(x: float) -> mp.mpf:
    """The curve of sRGB for 0 to 1, to 50 digits."""
    if x <= TOE:
        return mp.mpf("12.92") * x
    return mp.mpf("1.055") * mp.mpf(x) ** (1 / mp.mpf("2.4")) - mp.mpf("0.055")


def code(x: float, display: Display) -> int:
    """Black for no number, black and white beyond the range, else the nearest code."""
    exposed = 0.0 if math.isnan(x) else x * 2.0**display.exposure
    clipped = min(max(exposed, 0.0), 1.0)
    shown = curve(clipped) if display.transfer == "srgb" else mp.mpf(clipped)
    return int(mp.floor(255 * shown + mp.mpf("0.5")))


def codes_of(values: np.ndarray, display: Display) -> np.ndarray:
    return displayed(np.repeat(values.reshape(1, -1, 1), 3, axis=2), display)[0, :, 0]


@pytest.mark.parametrize("stops", [-100, 0, 1])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_code_is_the_nearest_or_the_end(stops: float, transfer: str) -> None:
    ends = [math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e-45, 1e300, -1e300, 3.4e38, 1e30, -0.2, 1.7]
    values = np.array([*ends, *np.random.default_rng(7).random(50)])
    display = Display.model_validate({"exposure": stops, "transfer": transfer})
    assert codes_of(values, display).tolist() == [code(x, display) for x in values.tolist()]


def test_code_survives_the_way_to_linear_and_back() -> None:
    codes = np.arange(256)
    linear = linear_from_srgb((codes / 255).astype(np.float32))
    with Image.open(
        io.BytesIO(encode_png(np.repeat(linear.reshape(1, -1, 1), 3, axis=2), Display()))
    ) as file:
        assert (np.asarray(file)[0] == codes[:, None]).all()
    assert (codes_of((codes / 255).astype(np.float32), Display(transfer="linear")) == codes).all()


def test_toe_of_the_curve_is_exact_and_climbs() -> None:
    """Around the joint, near 0 and 1, and below 0, without a warning."""
    inside = np.array([0.0, 5e-324, 1e-20, np.nextafter(TOE, 0), TOE, np.nextafter(TOE, 1), 0.5, 1.0])
    true = np.array([float(curve(x)) for x in inside.tolist()])
    assert (np.abs(srgb_from_linear(inside) - true) <= 8 * EPS * true).all()
    below = -np.geomspace(1e-300, 1e30, 100)
    climbing = np.sort(np.concatenate((below, inside, np.linspace(0.001, 0.01, 10000))))
    assert (np.diff(codes_of(climbing, Display()).astype(int)) >= 0).all()


def test_radiance_beyond_float32_is_white_and_counted() -> None:
    glaring = {"plain": phong([1e30] * 3, ambient=1e30)}
    floor = rectangle([-90, 0, -90], [0, 0, 180], [180, 0, 0])
    down = camera(position=[0, 5, 0.5], look_at=[0, 0, 0])
    result = renderer.render(plan_of(scene(floor, camera=down, ambient=[1e30] * 3, materials=glaring)))
    assert (displayed(result.image, Display()) == 255).all()
    assert result.report["numerics"]["clamped"] == 384
    assert result.report["numerics"]["non_finite"] == 0
