"""Random tiny scenes of rare combinations end, and give finite pictures without a warning."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

import renderer
from schemas.quality import Quality, TargetQuality
from tests.documents import bulb, camera, rectangle, scene, sphere
from tests.pictures.parts import Files
from tests.pictures.rare_scenes import FILES, rare_request, rare_scene

FEW, SCENES, AT_ONCE = 30, 300, 10

HANG_SECONDS = 30.0
"""CPU seconds after which a scene counts as endless: a few times what the slowest takes."""

QUALITIES: TypeAdapter[Quality] = TypeAdapter(Quality)


@contextmanager
def replayable(seed: int, mode: str) -> Iterator[None]:
    """A failure says how to reproduce it; a render that does not end is a failure."""

    def endless(*_: Any) -> None:
        raise TimeoutError(f"The picture has taken {HANG_SECONDS} CPU seconds.")

    before = signal.signal(signal.SIGVTALRM, endless)
    signal.setitimer(signal.ITIMER_VIRTUAL, HANG_SECONDS)
    try:
        yield
    except Exception as error:
        raise AssertionError(f"{error!r}\nReplay: {replay(seed, mode)}") from error
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def replay(seed: int, mode: str) -> str:
    return f"python -c 'from tests.pictures.test_rare_scenes import drawn; drawn({seed}, {mode!r})'"


def plan_of(seed: int, mode: str) -> renderer.RenderPlan:
    request = rare_request(seed, mode)
    scene = renderer.load_scene(rare_scene(seed), assets=Files(FILES))
    return renderer.compile_scene(
        scene, QUALITIES.validate_python(request["quality"]), layers=request["layers"]
    )


def drawn(seed: int, mode: str) -> renderer.RenderResult:
    """The picture of a scene; every tenth in other tiles as well."""
    plan = plan_of(seed, mode)
    result = renderer.render(plan)
    assert np.isfinite(result.image).all()
    assert result.image.min() >= 0
    assert result.report["numerics"]["non_finite"] == 0
    hit = np.isfinite(result.layers["depth"]) if "depth" in result.layers else None
    for name, layer in result.layers.items():
        assert layer.shape[:2] == result.image.shape[:2]
        if hit is not None and name != "error":
            assert np.isfinite(layer[hit]).all(), name
    if seed % 10 == 0:
        again = renderer.render(plan, tile_size=5)
        assert again.image.tobytes() == result.image.tobytes()
        for name, layer in result.layers.items():
            assert again.layers[name].tobytes() == layer.tobytes(), name
    return result


@pytest.mark.parametrize("seed", range(FEW))
def test_rare_scenes_are_finite(seed: int) -> None:
    with replayable(seed, "fixed"):
        drawn(seed, "fixed")


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "begin"), [("fixed", FEW), ("target", 0)])
@pytest.mark.parametrize("part", range(AT_ONCE))
def test_many_rare_scenes_are_finite(mode: str, begin: int, part: int) -> None:
    for seed in range(begin + part, SCENES, AT_ONCE):
        with replayable(seed, mode):
            drawn(seed, mode)


def test_rare_scenes_have_all_parts() -> None:
    """Pairs that crashed once, or might: each is in several of the scenes."""
    texts = [str(rare_scene(seed)) for seed in range(SCENES)]
    pairs = [
        ("'displacement_map'", "'vertices'"),
        ("'displacement_map'", "'mesh.obj'"),
        ("'lens_radius'", "'transmission'"),
        ("'mipmap'", "'normal_map'"),
        ("'bump_map'", "'mirror': 1"),
        ("'box'", "'smooth': True"),
        ("'physical'", "'uvs'"),
        ("'directional'", "'normals'"),
    ]
    for some, other in pairs:
        assert sum(some in text and other in text for text in texts) >= 5, (some, other)


def test_tiny_picture_of_an_unreachable_error() -> None:
    """It ends all the same, with at least a thousand samples a pixel."""
    target = TargetQuality(mode="target", error=1e-6)
    shapes = sphere([0, 1, 0], 1), rectangle([-4, 0, -4], [0, 0, 9], [8, 0, 0])
    document = scene(*shapes, lights=[bulb([1, 3, 2])], camera=camera(width=2, height=1))
    report = renderer.render(renderer.compile_scene(document, target)).report
    assert report["error"]["estimate"] > target.error
    assert report["samples"]["antialiasing_mean"] >= 1000
