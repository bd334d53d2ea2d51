"""Our pictures against those of POV-Ray with the very same camera rays and light points."""

import numpy as np
import pytest

import renderer
from accuracy.variations import fixed_quality
from benchmarks import povray_pictures, references
from benchmarks.povray_pictures import PovraySetting
from benchmarks.povray_scene import LightGrid
from schemas.reading import read_scene
from schemas.scene import Scene

pytestmark = [
    pytest.mark.slow,
    pytest.mark.peer,
    pytest.mark.skipif(povray_pictures.version() is None, reason="needs POV-Ray 3.7"),
]

STEP = 1 / 65535
"""POV-Ray's pictures have 16 bits, so its values are within half a step of what it computed."""
SIDE = 128


def small(name: str) -> Scene:
    """A study scene, 128 x 128."""
    scene, _ = read_scene(references.PATHS[name].read_bytes())
    return scene.model_copy(
        update={"camera": scene.camera.model_copy(update={"width": SIDE, "height": SIDE})}
    )


# Edges of the soft room run along the picture's diagonals, through the very middles of pixels, where rounding
# decides. Together they are shorter than one diagonal.
@pytest.mark.parametrize(("name", "undecided"), [("soft", SIDE), ("chess", 0)])
def test_one_ray_a_pixel_and_4_x_4_light_points_give_the_same_values(name: str, undecided: int) -> None:
    scene = small(name)
    ours = renderer.render(renderer.compile_scene(scene, fixed_quality("center", 1, "uniform", 16))).image
    _, theirs = povray_pictures.picture(scene, PovraySetting(LightGrid(4, "points")))
    different = np.abs(np.clip(ours, 0, 1) - theirs).max(axis=2) > STEP
    assert different.sum() <= undecided


def test_more_light_points_come_nearer_to_the_converged_picture() -> None:
    """With pixels divided where they differ: what a comparison of errors relies on."""
    converged, _ = references.load("soft")
    scene, _ = read_scene(references.PATHS["soft"].read_bytes())
    errors = [
        references.rmse_255(
            povray_pictures.picture(scene, PovraySetting(LightGrid(side, "points"), 0.1, 2))[1], converged
        )
        for side in (1, 3)
    ]
    assert errors[1] < errors[0] / 2


def test_a_scene_that_it_cannot_say_is_refused() -> None:
    scene, _ = read_scene(references.PATHS["lamp"].read_bytes())
    with pytest.raises(ValueError, match="rectangle light"):
        povray_pictures.picture(scene, PovraySetting(LightGrid(4, "points")))
