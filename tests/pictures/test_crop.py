"""A crop is the same part of the whole picture, byte for byte."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import renderer
from schemas.errors import SceneError
from schemas.quality import TargetQuality
from tests.pictures import pictures
from tests.pictures.parts import image_of

CROP = (7, 3, 11, 9)
GALLERY = Path(__file__).parents[2] / "scenes" / "gallery"


def cropped(document: dict[str, Any], crop: tuple[int, ...] | None = CROP) -> dict[str, Any]:
    return {**document, "camera": {**document["camera"], "crop": crop}}


def part(image: np.ndarray) -> np.ndarray:
    x, y, width, height = CROP
    return image[y : y + height, x : x + width]


@pytest.mark.parametrize(
    "name", ["basic", *(pytest.param(x, marks=pytest.mark.slow) for x in ("lens", "mesh"))]
)
@pytest.mark.parametrize("pattern", ["random", "sobol"])
def test_crop_has_the_pixels_of_the_whole(name: str, pattern: str) -> None:
    document = json.loads((GALLERY / f"{name}.json").read_text())
    document["camera"] |= {"width": 26, "height": 18}
    document["sampling"] = {
        "antialiasing": {"pattern": pattern, "samples": 4},
        "light": {"pattern": pattern, "samples": 4},
    }

    def drawn(scene: dict[str, Any]) -> renderer.RenderResult:
        loaded = renderer.load_scene(scene, assets=GALLERY)
        return renderer.render(renderer.compile_scene(loaded, layers=["depth", "shape"]), tile_size=8)

    whole, crop = drawn(document), drawn(cropped(document))
    assert crop.image.tobytes() == part(whole.image).tobytes()
    for layer, values in crop.layers.items():
        assert values.tobytes() == part(whole.layers[layer]).tobytes()


@pytest.mark.slow
def test_crop_of_target_quality() -> None:
    room = pictures.of_room()
    room["camera"] |= {"width": 64, "height": 48}
    true = image_of({**room, "sampling": {"antialiasing": {"pattern": "sobol", "samples": 256}}})
    aim = TargetQuality(mode="target", error=0.01)
    image = image_of(cropped(room, (20, 10, 32, 24)), aim)
    left = np.clip(image, 0, 1) - np.clip(true, 0, 1)[10:34, 20:52]
    assert np.sqrt(np.mean(left**2)) < 0.0125


@pytest.mark.parametrize(("crop", "message"), [((14, 0, 11, 9), "24 x 16"), ((3, 3, 0, 5), "no pixels")])
def test_invalid_crop(crop: tuple[int, ...], message: str) -> None:
    with pytest.raises(SceneError) as caught:
        renderer.load_scene(cropped(pictures.of_room(), crop))
    (problem,) = caught.value.errors
    assert problem.pointer == "/camera/crop"
    assert message in problem.detail
