"""The scenes that come with the package are what their descriptions say."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import scenes
from scenes import make_meshes, make_textures, scene_path
from schemas.reading import read_scene
from schemas.scene import Scene
from schemas.shapes import Parallelogram, Triangle
from schemas.textures import CheckerTexture, ImageTexture

GALLERY = Path(scenes.__file__).parent / "gallery"


def packaged(name: str) -> Scene:
    return read_scene(scene_path(name).read_bytes())[0]


def test_the_gallery_has_its_five_scenes_each_with_a_sentence() -> None:
    names = {path.name for path in GALLERY.glob("*.json")}
    assert names >= {
        "basic.json",
        "texturing.json",
        "normal_texturing.json",
        "antialiasing_uniform.json",
        "antialiasing_rotated.json",
    }
    page = (GALLERY / "README.md").read_text(encoding="utf-8")
    assert [name for name in names if f"[{name}]({name})" not in page] == []


def test_a_missing_scene_is_reported_with_those_that_are_there() -> None:
    with pytest.raises(FileNotFoundError, match="gallery/basic"):
        scene_path("gallery/nowhere")


@pytest.mark.parametrize("path", sorted(GALLERY.glob("*.json")), ids=lambda path: path.stem)
def test_every_image_of_a_gallery_scene_is_beside_it(path: Path) -> None:
    for texture in read_scene(path.read_bytes())[0].textures.values():
        if isinstance(texture, ImageTexture):
            assert (GALLERY / texture.asset).is_file()


def test_the_antialiasing_scenes_differ_in_their_pattern_only() -> None:
    uniform, rotated = (
        json.loads(scene_path(f"gallery/antialiasing_{p}").read_text()) for p in ("uniform", "rotated")
    )
    for scene in (uniform, rotated):
        pattern = scene["sampling"]["antialiasing"]
        assert pattern["samples"] == 16
        assert scene.pop("name") == f"antialiasing_{pattern.pop('pattern')}"
    assert uniform == rotated


def test_the_texturing_scenes_differ_in_their_normal_map_only() -> None:
    flat, relief = (
        json.loads(scene_path(f"gallery/{name}").read_text()) for name in ("texturing", "normal_texturing")
    )
    relief["name"] = "texturing"
    del relief["textures"][relief["materials"]["panel"].pop("normal_map")]
    assert flat == relief


def test_the_texture_files_are_what_the_script_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_the_shell_is_what_the_script_makes() -> None:
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


def test_every_normal_of_the_relief_points_outwards_with_unit_length() -> None:
    texels = np.asarray(Image.open(GALLERY / "textures" / "tiles_normal.png")) / 127.5 - 1
    assert texels[..., 2].min() > 0
    # Each of three components is off by half a code, 1 / 255.
    assert abs(np.linalg.norm(texels, axis=-1) - 1).max() <= math.sqrt(3) / 255


@pytest.mark.parametrize("name", ["soft", "chess"])
def test_the_study_scenes_take_16_camera_samples_and_8_x_8_light_points(name: str) -> None:
    sampling = packaged(f"study/{name}").sampling
    assert (sampling.antialiasing.pattern, sampling.antialiasing.samples) == ("uniform", 16)
    assert (sampling.light.pattern, sampling.light.samples) == ("uniform", 64)


def test_the_block_of_soft_is_closed_and_faces_outwards() -> None:
    triangles = [shape.vertices for shape in packaged("study/soft").shapes if isinstance(shape, Triangle)]
    assert len(triangles) == 12
    edges = Counter((a, b) for v in triangles for a, b in zip(v, v[1:] + v[:1], strict=True))
    assert all(edges[a, b] == 1 == edges[b, a] for a, b in edges)
    corners = np.array(triangles)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(8 * 0.5 * 0.8 * 0.5, rel=1e-14)


def test_the_block_of_soft_is_turned_by_20_degrees_about_the_vertical() -> None:
    vertices = {
        vertex
        for shape in packaged("study/soft").shapes
        if isinstance(shape, Triangle)
        for vertex in shape.vertices
    }
    # Seen in the block's own frame, z turns towards x.
    cosine, sine = math.cos(math.radians(20)), math.sin(math.radians(20))
    own = {
        (
            round((x - 0.95) * cosine - (z + 0.6) * sine, 12),
            round(y - 0.8, 12),
            round((x - 0.95) * sine + (z + 0.6) * cosine, 12),
        )
        for x, y, z in vertices
    }
    assert own == {(x, y, z) for x in (-0.5, 0.5) for y in (-0.8, 0.8) for z in (-0.5, 0.5)}


def test_the_board_of_chess_is_light_where_the_floors_of_x_and_z_add_up_to_an_even_number() -> None:
    scene = packaged("study/chess")
    board, ground = scene.textures["board"], scene.shapes[0]
    assert isinstance(board, CheckerTexture)
    assert isinstance(ground, Parallelogram)
    assert (board.even, board.odd) == ((0.9,) * 3, (0.1,) * 3)
    for x in range(-16, 16):
        for z in range(-16, 16):
            u = (x + 0.5 - ground.corner[0]) / ground.edges[0][0]
            v = (z + 0.5 - ground.corner[2]) / ground.edges[1][2]
            field = math.floor(u * board.repeat[0]) + math.floor(v * board.repeat[1])
            assert field % 2 == (x + z) % 2


def test_the_light_is_seen_in_soft_and_not_in_chess() -> None:
    assert [packaged(f"study/{name}").lights[0].visible for name in ("soft", "chess")] == [True, False]
