"""The scenes, rays and references of the ready assignment match the scripts that make them."""

import json

import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import Picture, compare, read_picture
from accuracy.comparison.noise import sample_variances
from scenes import make_assignment, make_assignment_rays, make_assignment_references
from scenes.make_assignment_parts import FOLDER, HEIGHT, WIDTH
from service.grading import wanted
from service.grading.folders import Folder
from tests.service.grading.assignment.shapes import Wrong
from tests.service.grading.assignment.submissions import document
from tests.service.grading.assignment.tracer import Tracer, encoded

SCENES = {**make_assignment.PICTURES, **make_assignment_rays.RAYS}

MEBIBYTE = 1 << 20


def reference(name: str) -> Picture:
    """A reference with its layers, as the grader reads it."""
    folder = Folder(FOLDER.resolve(), "reference")
    return wanted.read_picture(folder, f"references/{name}.npz", "linear")[1]


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_matches_its_script(name: str) -> None:
    assert document(name) == json.loads(json.dumps(SCENES[name]()))


@pytest.mark.parametrize(("name", "seed"), [(name, i) for i, name in enumerate(make_assignment_rays.RAYS)])
def test_rays_match_their_script(name: str, seed: int) -> None:
    """exp and norms may differ by an ulp between machines."""
    with np.load(FOLDER / f"{name}.npz") as kept:
        for made, array in zip(
            make_assignment_rays.rays(document(name), seed), ("origins", "directions"), strict=True
        ):
            np.testing.assert_allclose(kept[array], made, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    ("file", "draw"), [("arrow", make_assignment.arrow), ("studs_normal", make_assignment.studs)]
)
def test_a_texture_matches_its_script(file: str, draw: object) -> None:
    assert callable(draw)
    kept = np.asarray(Image.open(FOLDER / "textures" / f"{file}.png")).astype(int)
    # sqrt may differ by an ulp between machines, so values may round to neighbouring codes.
    assert abs(kept - draw().astype(int)).max() <= 1


def test_the_texture_has_no_symmetry() -> None:
    texels = make_assignment.arrow().astype(int)
    turned = [np.rot90(t, k) for t in (texels, texels.transpose(1, 0, 2)) for k in range(4)]
    assert all(abs(texels - other).mean() > 10 for other in turned[1:])


@pytest.mark.parametrize("name", make_assignment.PICTURES)
def test_a_reference_agrees_with_its_scene_rendered_again_with_fewer_samples(name: str) -> None:
    scene = document(name)
    # An upright grid would show four steps on each edge of the scene for advanced anti-aliasing.
    few = {"pattern": "sobol", "samples": 16}
    scene["sampling"] = {"antialiasing": few, "light": few}
    rendered = make_assignment_references.rendered(scene)
    kept = reference(name)
    assert kept.linear.shape == (HEIGHT, WIDTH, 3)
    worst = np.abs(rendered - kept.linear).mean()
    # Means of 16 samples differ from the reference only at edges, by a fraction of the contrast.
    assert worst < 0.01


@pytest.mark.parametrize("name", make_assignment.PICTURES)
def test_the_png_matches_the_array(name: str) -> None:
    pictures = read_picture(FOLDER / "references" / f"{name}.png", "srgb"), reference(name)
    # Rounding to 8 bits and to float16.
    assert abs(pictures[0].linear - pictures[1].linear).max() <= 0.01
    assert compare(*pictures).passed


def test_each_reference_has_its_error_and_all_are_far_below_the_noise_of_16_samples() -> None:
    errors = json.loads((FOLDER / "references" / "errors.json").read_text())
    assert set(errors) == set(make_assignment.PICTURES)
    # The scene with the least noise has an RMSE of 0.0019 at 16 random samples.
    assert max(errors.values()) < 0.001


def test_the_whole_assignment_is_small_enough_for_the_package() -> None:
    assert sum(file.stat().st_size for file in FOLDER.rglob("*") if file.is_file()) < 2 * MEBIBYTE


def test_sheets_of_normals_are_of_unit_length_where_a_pixel_lies_inside_a_flat_shape() -> None:
    codes = reference("rays_flat_normals").linear
    lengths = np.linalg.norm(2 * codes - 1, axis=2)
    seen = codes.any(axis=2)
    # More than half of the covered pixels are not at an edge; float16 rounds to 2**-11.
    assert (abs(lengths[seen] - 1) < 2**-9).mean() > 0.5


def codes(name: str, wrong: Wrong, lights: bool = True) -> np.ndarray:
    """8-bit codes of a picture by a simple ray tracer, the same random numbers for all mistakes."""
    scene = document(name)
    if not lights:
        scene["lights"] = []
    return encoded(Tracer(scene, FOLDER, wrong).picture(samples=1))


@pytest.mark.parametrize(
    "name", ["camera_straight", "camera_tilted", "antialiasing", "antialiasing_advanced"]
)
def test_pictures_of_positions_do_not_depend_on_how_shapes_are_shaded(name: str) -> None:
    right = codes(name, frozenset())
    np.testing.assert_array_equal(codes(name, frozenset(["no_ambient", "normal_flipped"])), right)
    np.testing.assert_array_equal(codes(name, frozenset(), lights=False), right)
    # Three channels that differ, so that their order is visible.
    assert len(set(right.reshape(-1, 3).max(axis=0).tolist())) == 3


def test_the_picture_of_textures_needs_no_ambient_light() -> None:
    np.testing.assert_array_equal(codes("texture", frozenset(["no_ambient"])), codes("texture", frozenset()))


def test_drawing_the_last_hit_changes_most_pictures() -> None:
    wrong, right = frozenset(["last_shape_wins"]), frozenset[str]()
    changed = [name for name in make_assignment.PICTURES if share(name, wrong, right) > 0.05]
    assert len(changed) > len(make_assignment.PICTURES) / 2, changed


def share(name: str, first: Wrong, second: Wrong) -> float:
    """Share of the pixels that two programs draw differently."""
    return float((codes(name, first) != codes(name, second)).any(axis=2).mean())


@pytest.mark.parametrize("name", ["phong_matte", "normal_map"])
def test_a_reference_states_the_variance_of_one_sample(name: str) -> None:
    """Of one sample of each of 12,288 pixels and of its 3 channels: the sums agree within a tenth."""
    kept = reference(name)
    single = sample_variances(kept)
    assert single is not None
    drawn = Tracer(document(name), FOLDER, seed=5).picture(samples=1)
    assert ((drawn - kept.linear) ** 2).sum() == pytest.approx(single.sum(), rel=0.1)
