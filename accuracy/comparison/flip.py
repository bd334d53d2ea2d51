"""What people would see when the pictures are flipped between: FLIP (Andersson and others 2020)."""

import numpy as np

from renderer.errors import MissingExtraError
from renderer.images.colors import srgb_from_linear
from renderer.math.arrays import Floats

DEGREE = 67.0
"""Pixels in a degree of the field of view: a screen 0.7 m wide with 3840 pixels at 0.7 m, as in the paper."""


def flip(image: Floats, reference: Floats) -> float:
    """Mean LDR-FLIP of two linear pictures (H, W, 3) with values 0..1; 0 for equal ones, at most 1.

    In single precision, by the authors' own library.

    Raises
    ------
    MissingExtraError
        If that is not installed.
    """
    try:
        from flip_evaluator import evaluate  # noqa: PLC0415  an extra that most installations do without
    except ImportError as error:
        raise MissingExtraError(
            "FLIP needs the package flip-evaluator. Install it with: pip install 'penumbra-render[flip]'"
        ) from error

    seen = [srgb_from_linear(picture).astype(np.float32) for picture in (reference, image)]
    _, mean, _ = evaluate(*seen, "LDR", applyMagma=False, parameters={"ppd": DEGREE})
    return float(mean)
