"""Write docs/images/layers.png: depth, normal and shape of a gallery scene side by side.

Run it with ``python -m tools.docs.make_layers_picture``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

import renderer

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "scenes" / "gallery" / "basic.json"
PICTURE = ROOT / "docs" / "images" / "layers.png"
PALETTE = np.array(
    [
        (68, 119, 170),
        (204, 187, 68),
        (34, 136, 51),
        (238, 102, 119),
        (170, 51, 119),
        (102, 204, 238),
        (187, 187, 187),
    ],
    np.uint8,
)
"""Colours that people with any colour vision can distinguish (Paul Tol's bright scheme)."""


def shown(layers: renderer.layers.Layers) -> list[np.ndarray]:
    """Colour codes (H, W, 3) of depth, normal and shape; what shows no shape is black."""
    depth, shape = layers["depth"], layers["shape"]
    seen = shape >= 0
    near, far = depth[seen].min(), depth[seen].max()
    grey = np.where(seen, 1 - 0.9 * (depth - near) / (far - near), 0)
    normal = np.where(seen[..., None], (layers["normal"] + 1) / 2, 0)
    colored = np.where(seen[..., None], PALETTE[shape % len(PALETTE)], np.uint8(0))
    return [np.uint8(255 * grey)[..., None].repeat(3, axis=2), np.uint8(255 * normal), colored]


def main() -> None:
    """Render the layers alone, one camera sample and no light, and save them."""
    scene = renderer.load_scene(SCENE)
    quick = {"antialiasing": {"pattern": "center"}, "light": {"samples": 1}}
    document = scene.document.model_dump(mode="json", exclude_none=True) | {"sampling": quick, "lights": []}
    plan = renderer.compile_scene(document, layers=["depth", "normal", "shape"])
    Image.fromarray(np.hstack(shown(renderer.render(plan).layers))).reduce(2).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
