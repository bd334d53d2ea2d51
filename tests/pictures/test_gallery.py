"""Every scene of the gallery, small: no number in it is a bad one."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

import renderer
import scenes
from renderer.assets import FolderAssets
from schemas.quality import FixedQuality
from tests.pictures.parts import DOUBLE, SINGLE

GALLERY = Path(scenes.__file__).parent / "gallery"


@pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
@pytest.mark.parametrize("path", sorted(GALLERY.glob("*.json")), ids=lambda path: path.stem)
def test_gallery_has_no_bad_pixel(path: Path, quality: FixedQuality) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    document["camera"] |= {"width": 48, "height": 32}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = renderer.load_scene(document, assets=FolderAssets(GALLERY))
        result = renderer.render(renderer.compile_scene(scene, quality))
    assert set(result.report["numerics"].values()) == {0}
    assert np.isfinite(result.image).all()
