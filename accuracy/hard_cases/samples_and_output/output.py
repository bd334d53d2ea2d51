"""Hard cases I: from radiance to the codes of a picture file."""

import io
import math
import warnings
from collections.abc import Iterator
from functools import partial

import mpmath
import numpy as np
from numpy.typing import NDArray
from PIL import Image

import renderer
from accuracy.hard_cases.documents import Json, bulb, camera, lamp, phong, rectangle, room, scene
from accuracy.hard_cases.harness import (
    EPS,
    Cases,
    Outcome,
    Outcomes,
    compiled,
    exact,
    in_both,
    plain_only,
    tally,
)
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.images.files import displayed, encode_png
from schemas.scene import Display

Values = NDArray[np.floating]
Codes = NDArray[np.uint8]


def curve(x: float) -> mpmath.mpf:
    """The curve of sRGB for 0 to 1; its branches part at the double nearest to 0.0031308."""
    if x <= 0.0031308:
        return mpmath.mpf("12.92") * x
    return mpmath.mpf("1.055") * mpmath.mpf(x) ** (1 / mpmath.mpf("2.4")) - mpmath.mpf("0.055")


@exact
def curve_of(x: float) -> float:
    """The same to 50 digits, rounded once."""
    return float(curve(x))


@exact
def code(x: float, display: Display) -> int:
    """The code of a number: black for none, black and white beyond the range, else the nearest."""
    exposed = 0.0 if math.isnan(x) else x * 2.0**display.exposure
    clipped = min(max(exposed, 0.0), 1.0)
    shown = curve(clipped) if display.transfer == "srgb" else mpmath.mpf(clipped)
    return int(mpmath.floor(255 * shown + mpmath.mpf("0.5")))


DISPLAYS = tuple(
    display
    for stops in (-100, -1, 0, 1, 100)
    for display in (Display(exposure=stops), Display(exposure=stops, transfer="linear"))
)


def codes_of(values: Values, display: Display) -> Codes:
    """Codes (N,) of a picture of one row."""
    return displayed(np.repeat(values.reshape(1, -1, 1), 3, axis=2), display)[0, :, 0]


def plain_codes(values: Values, dtype: type[np.floating]) -> Codes:
    """Codes (N,) by a product and a cast."""
    return (values.astype(dtype) * dtype(255)).astype(np.uint8)


def no_brightness() -> Iterator[Outcomes]:
    """NaN, infinities, zeros, the smallest and the largest numbers, and some between."""
    ends = [math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e-45, 1e300, -1e300, 3.4e38, 1e30, -0.2, 1.7]
    values = np.array([*ends, *np.random.default_rng(7).random(50)])
    for display in DISPLAYS:
        true = np.array([code(x, display) for x in values.tolist()])
        plain = (tally(codes != true) for codes in in_both(partial(plain_codes, values)))
        unexposed = display.exposure == 0 and display.transfer == "linear"
        wrong = tally(codes_of(values, display) != true)
        yield Outcome(values.size, wrong, *(plain if unexposed else ()))


def truncated(linear: Values, dtype: type[np.floating]) -> Codes:
    """Codes of linear values by the curve and a cast, which leaves out what is behind the point."""
    x = linear.astype(dtype)
    shown = np.where(
        x <= dtype(0.0031308), dtype(12.92) * x, dtype(1.055) * x ** dtype(1 / 2.4) - dtype(0.055)
    )
    return plain_codes(shown, dtype)


def there_and_back() -> Outcomes:
    """Code to linear value and back again."""
    codes = np.arange(256)
    linear = linear_from_srgb((codes / 255).astype(np.float32))
    picture = np.repeat(linear.reshape(1, -1, 1), 3, axis=2)
    with Image.open(io.BytesIO(encode_png(picture, Display()))) as file:
        read = np.asarray(file)[0]
    plain = (tally(each != codes) for each in in_both(partial(truncated, linear)))
    found = (codes_of(linear, Display()), *read.T)
    evenly = codes_of((codes / 255).astype(np.float32), Display(transfer="linear"))
    outcomes = [Outcome(256, tally(f != codes)) for f in (*found, evenly)]
    return [*outcomes, plain_only(*plain)]


def toe_of_the_curve() -> Outcome:
    """Around the joint, near 0 and 1, and below 0."""
    toe = 0.0031308
    inside = np.array([0.0, 5e-324, 1e-20, np.nextafter(toe, 0), toe, np.nextafter(toe, 1), 0.5, 1.0])
    true = np.array([curve_of(x) for x in inside.tolist()])
    off = np.abs(srgb_from_linear(inside) - true) > 8 * EPS * true
    below = -np.geomspace(1e-300, 1e30, 100)
    climbing = np.sort(np.concatenate((below, inside, np.linspace(0.001, 0.01, 10000))))
    powers = in_both(lambda dtype: np.power(below.astype(dtype), dtype(1 / 2.4)))
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        codes = codes_of(climbing, Display()).astype(int)
    falling = tally(np.diff(codes) < 0)
    wrong = tally(off) + falling + len(raised)
    return Outcome(inside.size + climbing.size, wrong, *(tally(np.isnan(each)) for each in powers))


def bright_and_black() -> Outcomes:
    """Lights of 1e30, a surface that is beyond float32, and a room without light."""
    floor = rectangle([-90, 0, -90], [0, 0, 180], [180, 0, 0])
    glaring = {"plain": phong([1e30] * 3, ambient=1e30)}
    down = camera(position=[0, 5, 0.5], look_at=[0, 0, 0])
    dark = {"background": [0, 0, 0], "ambient": [0, 0, 0]}
    return (
        _shown(255, 0, scene(floor, camera=down, lights=[bulb([0, 9, 0], [1e30] * 3)])),
        _shown(255, 24 * 16, scene(floor, camera=down, ambient=[1e30] * 3, materials=glaring)),
        _shown(0, 0, scene(*room(), lights=[lamp(*CEILING, [0, 0, 0]), bulb([0, 2, 0], [0, 0, 0])], **dark)),
    )


CEILING = ([-1.0, 3.9, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0])


def _shown(expected: int, clamped: int, document: Json) -> Outcome:
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        result = renderer.render(compiled(document))
        codes = displayed(result.image, Display())
    numerics = result.report["numerics"]
    miscounted = abs(numerics["clamped"] - clamped) + numerics["non_finite"]
    wrong = tally(codes != expected) + miscounted + len(raised)
    with np.errstate(all="ignore"):
        plain = plain_codes(result.image, np.float32)
    return Outcome(codes.size, wrong, tally(plain != expected))


CASES: Cases = {
    "I6: numbers that are no brightness": no_brightness,
    "I7: all codes there and back": there_and_back,
    "I8: the toe of the curve": toe_of_the_curve,
    "I9: very bright and quite black": bright_and_black,
}
