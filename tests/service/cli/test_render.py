"""``penumbra render`` and ``penumbra trace``."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import renderer
from accuracy.comparison import read_picture
from service.cli.errors import InputError
from service.cli.render import read_rays
from tests.service.cli.conftest import Penumbra


def test_process_with_workers_and_tiles_saves_the_same_bytes(
    here: Penumbra, penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    assert here("render", scene_file, "-o", "a.png", "--workers", 1).code == 0
    assert penumbra("render", scene_file, "-o", "b.png", "--workers", 2, "--tile", 9).code == 0
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (48, 32)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize("name", ["a.png", "a.npy", "a.exr"])
def test_python_saves_the_same_files(here: Penumbra, scene_file: Path, tmp_path: Path, name: str) -> None:
    folder = tmp_path / "python"
    folder.mkdir()
    assert here("render", scene_file, "-o", name, "--layers", "depth,shape", "--workers", 1).code == 0
    renderer.render(renderer.compile_scene(scene_file, layers=["depth", "shape"])).save(folder / name)
    saved = sorted(folder.iterdir())
    assert [file.name for file in saved] == [name, f"{name}.depth.npy", f"{name}.shape.npy"]
    for file in saved:
        assert file.read_bytes() == (tmp_path / file.name).read_bytes()


def test_png_of_16_bits(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    assert here("render", scene_file, "-o", "a.npy", "--workers", 1).code == 0
    assert here("render", scene_file, "-o", "A.PNG", "--bits", 16, "--workers", 1).code == 0
    picture, exact = read_picture(tmp_path / "A.PNG"), read_picture(tmp_path / "a.npy")
    assert (picture.bits, picture.encoding) == (16, "srgb")
    assert (np.abs(picture.linear - exact.linear) <= picture.rounding + exact.rounding).all()
    assert picture.rounding.max() < 2.0**-15
    refused = here("render", scene_file, "-o", "b.exr", "--bits", 16)
    assert refused.code == 2
    assert not (tmp_path / "b.exr").exists()


def test_unused_alpha_is_warned_of(here: Penumbra, scene: dict[str, Any], tmp_path: Path) -> None:
    Image.new("RGBA", (2, 2), (200, 100, 50, 128)).save(tmp_path / "a.png")
    scene["textures"] = {"clear": {"type": "image", "asset": "a.png"}}
    scene["materials"]["floor"] = {"type": "phong", "color_texture": "clear"}
    (tmp_path / "scene.json").write_text(json.dumps(scene, indent=2))
    outcome = here("render", "scene.json", "-o", "out.npy", "--workers", 1)
    assert outcome.code == 0
    assert outcome.err.count("alpha is not used") == 1
    assert '"asset": "a.png"' in outcome.err
    document = here("validate", "scene.json", "--json").document
    (warning,) = document["files"][0]["warnings"]
    assert (document["valid"], warning["pointer"]) == (True, "/textures/clear/asset")
    assert warning["line"] > 1


def test_json_report(here: Penumbra, scene_file: Path) -> None:
    words = ("--samples", 4, "--pattern", "rotated", "--workers", 1)
    report = here("render", scene_file, "-o", "a.png", "--json", *words).document
    assert {"seconds", "cpu_seconds", "rays", "error", "numerics", "plan"} <= report.keys()
    assert (report["width"], report["height"]) == (48, 32)
    assert report["samples"]["antialiasing_mean"] == 4
    assert report["rays"]["camera"] == 48 * 32 * 4


def test_picture_is_not_written_to_a_terminal(on_a_terminal: Penumbra, scene_file: Path) -> None:
    outcome = on_a_terminal("render", scene_file, "-o", "-")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.startswith("error: stdout is a terminal")


def test_seed_option(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    for name, seed in {"a": 1, "b": 1, "c": 2}.items():
        words = ["--seed", seed, "--pattern", "random", "--samples", 2, "--workers", 1]
        assert here("render", scene_file, "-o", f"{name}.npy", *words).code == 0
    a, b, c = (np.load(tmp_path / f"{name}.npy") for name in "abc")
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


DOWN = np.array([[0.0, 9.0, 0.0], [1.5, 9.0, 1.5], [9.0, 9.0, 9.0]]), np.tile([0.0, -2.0, 0.0], (3, 1))


def test_traced_rays_have_a_hits_file(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "rays.npz", origins=DOWN[0], directions=DOWN[1])
    outcome = here("trace", scene_file, "rays.npz", "-o", "hits.npz", "--json")
    assert outcome.code == 0
    assert (outcome.document["hits"], outcome.document["misses"]) == (2, 1)
    with np.load(tmp_path / "hits.npz") as hits:
        assert set(hits) == {"t", "position", "normal", "uv", "shape", "primitive", "visibility"}
        assert hits["shape"].tolist() == [1, 0, -1]
        assert hits["t"].tolist() == [3.5, 4.5, np.inf]
        assert hits["visibility"].shape == (3, 1)


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no directions": ({"origins": DOWN[0]}, "no array 'directions'"),
    "two columns": ({"origins": DOWN[0][:, :2], "directions": DOWN[1]}, r"'origins' has shape \(3, 2\)"),
    "other lengths": ({"origins": DOWN[0], "directions": DOWN[1][:2]}, "3 origins but 2 directions"),
    "words": ({"origins": np.full((3, 3), "x"), "directions": DOWN[1]}, "'origins' holds <U1"),
    "not finite": ({"origins": DOWN[0], "directions": np.diag([1, 1, np.nan])}, "row 2 of 'directions'"),
    "zero": ({"origins": DOWN[0], "directions": np.diag([1.0, 0, 1])}, "row 1 of 'directions' is zero"),
    "objects": ({"origins": np.array([None]), "directions": DOWN[1]}, "not an .npz file"),
}


@pytest.mark.parametrize(("arrays", "message"), WRONG.values(), ids=WRONG)
def test_unusable_rays_name_array_and_row(tmp_path: Path, arrays: dict[str, Any], message: str) -> None:
    np.savez(tmp_path / "rays.npz", **arrays)
    with pytest.raises(InputError, match=message):
        read_rays(tmp_path / "rays.npz")


@pytest.mark.parametrize("content", [b"", b"text", b"PK\x03\x04 cut off"])
def test_file_that_is_no_archive(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "rays.npz").write_bytes(content)
    with pytest.raises(InputError, match="savez"):
        read_rays(tmp_path / "rays.npz")


def test_far_origin_names_its_row(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "rays.npz", origins=np.diag([1, 1e200, 1]), directions=DOWN[1])
    outcome = here("trace", scene_file, "rays.npz", "-o", "hits.npz")
    assert outcome.code == 3
    assert re.search("rays.npz: .*row 1 of 'origins'", outcome.err)
    assert not (tmp_path / "hits.npz").exists()
