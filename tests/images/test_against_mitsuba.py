"""Our pictures against converged ones that another renderer made from the same scene files."""

import pytest

import renderer
from benchmarks import references
from schemas.quality import FixedQuality
from schemas.reading import read_scene
from schemas.sampling import Antialiasing, LightSampling
from schemas.scene import Scene

pytestmark = pytest.mark.slow

FINE = FixedQuality(
    mode="fixed",
    antialiasing=Antialiasing(pattern="uniform", samples=16),
    light=LightSampling(pattern="uniform", samples=64),
)


FOUR = FINE.model_copy(update={"light": LightSampling(pattern="stratified", samples=4)})


def scene_of(name: str) -> Scene:
    return read_scene(references.PATHS[name].read_bytes())[0]


@pytest.mark.parametrize("name", references.NAMES)
def test_the_reference_shows_the_scene_as_it_is_now(name: str) -> None:
    _, provenance = references.load(name)
    assert provenance.scene_sha256 == references.scene_digest(scene_of(name))


@pytest.mark.parametrize(
    ("name", "quality", "limit"),
    [
        ("soft", FINE, 1.0),
        ("chess", FINE, 2.4),
        ("mesh", FOUR, 2.5),
        ("normal_texturing", FOUR, 1.0),
        ("lamp", FOUR, 1.0),
    ],
)
def test_16_camera_samples_come_as_near_to_the_converged_picture_as_their_edges_allow(
    name: str, quality: FixedQuality, limit: float
) -> None:
    converged, provenance = references.load(name)
    assert provenance.own_error_255 <= 0.06
    image = renderer.render(renderer.compile_scene(references.PATHS[name], quality)).image
    assert references.rmse_255(image, converged) < limit
    # Edges err to both sides; a light, a material or a shadow that is wrong errs to one.
    assert abs(references.mean_difference_255(image, converged)) < 0.1


@pytest.mark.parametrize("name", references.NAMES)
def test_the_peer_draws_the_reference_again(name: str) -> None:
    """With 64 samples a pixel in place of thousands; its error falls with the samples, its mean stays."""
    peer = pytest.importorskip(
        "benchmarks.peer_pictures", reason="needs the extra `bench` and LLVM", exc_type=ImportError
    )
    converged, _ = references.load(name)
    rough, finer = (peer.picture(name, samples, seed=1000) for samples in (16, 64))
    assert references.rmse_255(finer, converged) < references.rmse_255(rough, converged) / 2
    assert abs(references.mean_difference_255(finer, converged)) < 0.01


def test_a_scene_that_the_peer_has_is_drawn_with_one_number_of_samples_after_another() -> None:
    """The edges of the shell's lamp have a coordinate that is 0."""
    peer = pytest.importorskip(
        "benchmarks.peer_pictures", reason="needs the extra `bench` and LLVM", exc_type=ImportError
    )
    scene = scene_of("shell")
    prepared = peer.convert(scene, references.PATHS["shell"].parent)
    first, second = (peer.shot(prepared, scene.camera, samples, seed=1) for samples in (1, 4))
    assert first.shape == second.shape == (512, 512, 3)
