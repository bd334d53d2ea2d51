import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service.converting.formats import convert
from service.converting.task import Conversion

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

COURSE: dict[str, Any] = {
    "spp": 16,
    "max_depth": 12,
    "image_resolution": [48, 32],
    "cam_config": {
        "position": [0, 1, 6.8],
        "look_at": [0, 1, 0],
        "ref_up": [0, 1, 0],
        "vertical_fov": 19.5,
        "focal_length": 1,
    },
    "light_config": {"position": [0, 1.98, 0], "size": [0.5, 0.3], "radiance": [17, 12, 5]},
    "materials": [{"color": [0.63, 0.065, 0.05], "type": "diffuse", "name": "red"}],
    "objects": [
        {
            "obj_file_path": "left.obj",
            "material_name": "red",
            "translate": [0.5, 0, -1],
            "scale": 2,
            "has_bvh": False,
        }
    ],
}

Convert = Callable[..., Conversion]


def course(**changes: Any) -> dict[str, Any]:
    """A course scene with other fields at its top."""
    document: dict[str, Any] = json.loads(json.dumps(COURSE))
    return document | changes


@pytest.fixture
def converted(tmp_path: Path) -> Convert:
    """Write an input with other files beside it, and convert it."""

    def run(name: str, content: bytes | dict[str, Any], **files: bytes) -> Conversion:
        folder = tmp_path / "input"
        folder.mkdir(exist_ok=True)
        for other, its_content in files.items():
            (folder / other).write_bytes(its_content)
        (folder / name).write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
        return convert(folder / name, root=folder, folder=tmp_path)

    return run


def noted(conversion: Conversion, kind: str) -> dict[str, str]:
    """Details of the assumptions of one kind by their place."""
    return {note.place: note.detail for note in conversion.assumptions if note.kind == kind}
