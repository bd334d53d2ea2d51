"""JPEG shows in pictures that it changed, and in no others."""

import numpy as np

from accuracy.comparison.compression import compressed, compression


def test_setting_of_jpeg_is_found_in_a_picture_of_several_colours_alone() -> None:
    rows, columns = np.mgrid[0:64, 0:64] / 64
    smooth = np.stack([rows, columns, rows * columns], axis=-1)
    noisy = np.clip(smooth + np.random.default_rng(1).normal(0, 0.05, smooth.shape), 0, 1)
    assert compression(compressed(noisy, ("JPEG", 75, 0))) == ("JPEG", 75, 0)
    assert compression(noisy) is None
    assert compression(np.full_like(smooth, 0.25)) is None
