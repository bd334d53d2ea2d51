"""Errors that passes of random samples report, against what pictures of other seeds differ by.

Two pictures with seeds of their own differ by the errors of both, so half their mean squared difference is
their mean squared error; no reference picture is needed. The threshold of four standard deviations of the
mean over pairs fails one right renderer in 16,000, somewhat more as the deviation is estimated from 12 pairs.
"""

import numpy as np
import pytest

import renderer
from tests.documents import camera, sampled
from tests.pictures import pictures
from tests.pictures.parts import plan_of

PAIRS = 12
SCENE = pictures.of_room(camera=camera(width=24, height=16))
LENS = pictures.of_room(camera=camera(width=24, height=16) | {"lens_radius": 0.05})


@pytest.mark.slow
@pytest.mark.parametrize("document", [SCENE, LENS], ids=["pinhole", "lens"])
@pytest.mark.parametrize("light", ["random", "stratified", "sobol"])
def test_reported_error_of_each_pass(document: dict[str, object], light: str) -> None:
    reported, images = [], []
    for seed in range(2 * PAIRS):
        sampling = sampled(16, 4, "random", light, seed=seed)
        result = renderer.render(plan_of(document | {"sampling": sampling}))
        reported.append(result.report["error"]["estimate"] ** 2)
        images.append(np.clip(result.image.astype(np.float64), 0, 1))
    pairs = np.array(reported).reshape(PAIRS, 2).mean(axis=1)
    true = np.array([((images[2 * i] - images[2 * i + 1]) ** 2).mean() / 2 for i in range(PAIRS)])
    room = 4 * (pairs - true).std(ddof=1) / np.sqrt(PAIRS)
    assert abs((pairs - true).mean()) < room
    # The comparison means something: it would notice an error twice as large or half as large.
    assert room < true.mean() / 2
