"""An assertion about two pictures, for the tests of renderers."""

import io
import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from accuracy.comparison.comparing import Comparison, compare
from accuracy.comparison.heat import Draw, difference, encoded, heat_map, seen
from accuracy.comparison.inputs import Picture, picture_of, read_picture
from accuracy.comparison.judging import Policy
from accuracy.comparison.pixels import Encoding
from accuracy.comparison.regions import named

PictureLike = str | os.PathLike[str] | bytes | NDArray[Any] | Image.Image | Any
"""A file or its bytes, an array (H, W, 3), an image of Pillow, or what `renderer.render` returns."""

PICTURES: Mapping[str, Draw] = {
    "actual": lambda image, _: seen(image),
    "reference": lambda _, reference: seen(reference),
    "difference": difference,
    "heat": heat_map,
}
"""Files of a difference, by name without their ending."""


DEFAULT_POLICY = Policy()


def assert_render_close(
    actual: PictureLike,
    reference: PictureLike,
    *,
    encoding: Encoding | None = None,
    reference_encoding: Encoding | None = None,
    tolerance: float = DEFAULT_POLICY.tolerance,
    max_bias: float = DEFAULT_POLICY.most_bias,
    folder: str | os.PathLike[str] | None = None,
) -> Comparison:
    """Assert that two pictures agree up to noise, as ``penumbra compare`` does.

    Parameters
    ----------
    actual, reference
        A .png, .npy or .exr file, its bytes, an array (H, W, 3), an image of Pillow, or a result of
        `renderer.render`. Floating point is linear, and PNG and Pillow are sRGB, unless the encoding is
        stated; whole numbers in an array need it.
    tolerance
        Mean difference of a block, linear, that is always tolerated.
    max_bias
        Share of biased blocks that is still noise.
    folder
        For pictures of a difference: actual, reference, difference, heat. It is created if missing; by
        default it is a new temporary folder. Nothing is written if the pictures agree.

    Returns
    -------
    Comparison
        All numbers, for further assertions.

    Raises
    ------
    AssertionError
        If they differ by more than noise. The message gives the verdict with its reason and margin, the
        probable mistake, and the regions that differ.
    NotComparableError
        If a picture cannot be read, or the two differ in size.

    Examples
    --------
    >>> grey = np.full((16, 16, 3), 0.5)
    >>> assert_render_close(grey, grey).judgement.verdict
    'match'
    """
    # pytest shows the line of the test, not this one.
    __tracebackhide__ = True
    found = compared(
        actual,
        reference,
        encoding=encoding,
        reference_encoding=reference_encoding,
        tolerance=tolerance,
        max_bias=max_bias,
    )
    if not found.passed:
        raise AssertionError(report(found, folder or tempfile.mkdtemp(prefix="penumbra-")))
    return found


def compared(
    actual: PictureLike,
    reference: PictureLike,
    *,
    encoding: Encoding | None = None,
    reference_encoding: Encoding | None = None,
    tolerance: float = DEFAULT_POLICY.tolerance,
    max_bias: float = DEFAULT_POLICY.most_bias,
) -> Comparison:
    """Compare two pictures of any form; parameters and errors are those of `assert_render_close`."""
    pictures = _read(actual, "actual", encoding), _read(reference, "reference", reference_encoding)
    return compare(*pictures, policy=Policy(tolerance=tolerance, most_bias=max_bias))


def report(found: Comparison, folder: str | os.PathLike[str]) -> str:
    """Write `PICTURES` of a mismatch to a folder, created if missing, and return its description."""
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    for name, draw in PICTURES.items():
        (place / f"{name}.png").write_bytes(encoded(draw, found.image, found.reference))
    files = ", ".join(f"{name}.png" for name in PICTURES)
    return "\n  ".join([*sentences(found), f"pictures: {files} in {place}"])


def sentences(found: Comparison) -> Iterator[str]:
    """Describe a mismatch: verdict, reason, probable mistake, regions and numbers."""
    yield f"{found.image.name} does not show what {found.reference.name} shows: {found.judgement.verdict}."
    yield found.judgement.reason
    if found.judgement.margin is not None:
        yield f"margin: {found.judgement.margin:+.0%} of the limit"
    for cause in found.causes:
        undone = f"undone {cause.rmse_after:.4f}" if cause.is_undone else "cannot be undone"
        yield f"probable cause: {cause.cause} (RMSE {cause.rmse_before:.4f}, {undone}). {cause.hint}"
    for region in found.regions:
        name = named(region.shape, found.names)
        yield (
            f"where: columns {region.x0} to {region.x1 - 1}, rows {region.y0} to {region.y1 - 1}"
            f"{f' ({name})' if name else ''}, too {'bright' if region.brightness > 0 else 'dark'} by "
            f"{abs(region.brightness):.3f}, {100 * region.share:.0f} % of the squared difference"
        )
    numbers = found.metrics
    yield f"rmse {numbers.rmse:.4g}  psnr {numbers.psnr:.4g}  max_abs {numbers.max_abs:.4g}"


def _read(source: PictureLike, name: str, encoding: Encoding | None) -> Picture:
    if isinstance(source, str | os.PathLike):
        return read_picture(source, encoding)
    if isinstance(source, bytes | bytearray | memoryview):
        return picture_of(bytes(source), name, encoding)
    if isinstance(source, Image.Image):
        buffer = io.BytesIO()
        source.save(buffer, format="PNG")
        return picture_of(buffer.getvalue(), name, encoding)
    layers = getattr(source, "layers", None)
    return picture_of(_file(getattr(source, "image", source)), name, encoding, layers)


def _file(pixels: NDArray[Any]) -> bytes:
    array = np.asarray(pixels)
    if array.dtype == object:
        kind = type(pixels).__name__
        raise TypeError(f"A picture is a path, bytes, an array or a Pillow image, not {kind}.")
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()
