"""The scenes that come with the package are what their descriptions say."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import scenes
from scenes import make_meshes, make_textures

GALLERY = Path(scenes.__file__).parent / "gallery"


def test_texture_files_are_drawn_by_the_script(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(make_textures, "FOLDER", tmp_path)
    monkeypatch.setattr(make_textures, "STUDY_FOLDER", tmp_path / "study")
    make_textures.main()
    copies = sorted(path.name for path in (tmp_path / "study").iterdir())
    kept_copies = Path(scenes.__file__).parent / "study" / "textures"
    assert copies == sorted(path.name for path in kept_copies.iterdir())
    for name in copies:
        assert (kept_copies / name).read_bytes() == (GALLERY / "textures" / name).read_bytes()
    for path in sorted((GALLERY / "textures").glob("*.png")):
        drawn, kept = (np.asarray(Image.open(file)).astype(int) for file in (tmp_path / path.name, path))
        # sin and sqrt may differ by an ulp between machines, so a value on the border of two codes may too.
        assert abs(drawn - kept).max() <= 1


def test_shell_is_made_by_the_script() -> None:
    """Closed but for its mouth, and equal to its file but for an ulp of sin, cos and exp."""
    vertices, triangles = make_meshes.shell()
    made, kept = make_meshes.ply(vertices, triangles), make_meshes.FILE.read_bytes()
    body = len(kept.partition(b"end_header\n")[0]) + len(b"end_header\n")
    places = slice(body, body + 12 * len(vertices))
    assert kept[:body] == made[:body]
    assert kept[places.stop :] == made[places.stop :]
    found, expected = (np.frombuffer(content[places], "<f4") for content in (kept, made))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)
    edges = np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert set(uses.tolist()) == {1, 2}
    assert (uses == 1).sum() == make_meshes.AROUND
