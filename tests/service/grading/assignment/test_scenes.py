"""The ready assignment's scenes, rays and references match the scripts that make them and each other."""

import json

import numpy as np
import pytest

from accuracy.comparison import Picture
from accuracy.comparison.noise import sample_variances
from scenes import make_assignment, make_assignment_rays, make_assignment_references
from scenes.make_assignment_parts import FOLDER
from service.grading import references
from service.grading.folders import Folder
from tests.service.grading.assignment.tracer import Tracer, read

SCENES = {**make_assignment.PICTURES, **make_assignment_rays.RAYS}


def reference(name: str) -> Picture:
    """A reference with its layers, as the grader reads it."""
    folder = Folder(FOLDER.resolve(), "reference")
    return references.read_picture(folder, f"references/{name}.npz", "linear")[1]


@pytest.mark.parametrize("name", SCENES)
def test_scene_matches_its_script(name: str) -> None:
    assert read(FOLDER, name) == json.loads(json.dumps(SCENES[name]()))


@pytest.mark.parametrize(("name", "seed"), [(name, i) for i, name in enumerate(make_assignment_rays.RAYS)])
def test_rays_match_their_script(name: str, seed: int) -> None:
    with np.load(FOLDER / f"{name}.npz") as kept:
        made = make_assignment_rays.rays(read(FOLDER, name), seed)
        for array, values in zip(("origins", "directions"), made, strict=True):
            # exp and norms may differ by an ulp between machines.
            np.testing.assert_allclose(kept[array], values, rtol=1e-12, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", make_assignment.PICTURES)
def test_reference_shows_its_scene(name: str) -> None:
    scene = read(FOLDER, name)
    few = {"pattern": "sobol", "samples": 16}
    scene["sampling"] = {"antialiasing": few, "light": few}
    # Means of 16 samples differ only at edges, by a fraction of the contrast.
    assert np.abs(make_assignment_references.rendered(scene) - reference(name).linear).mean() < 0.01


@pytest.mark.parametrize("name", ["phong_matte", "normal_map"])
def test_reference_states_the_variance_of_one_sample(name: str) -> None:
    kept = reference(name)
    single = sample_variances(kept)
    assert single is not None
    drawn = Tracer(read(FOLDER, name), FOLDER, seed=5).picture(samples=1)
    # Sums over 12,288 pixels and 3 channels.
    assert ((drawn - kept.linear) ** 2).sum() == pytest.approx(single.sum(), rel=0.1)
