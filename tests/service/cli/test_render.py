from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import renderer
from accuracy.comparison import read_picture
from tests.service.cli.conftest import CLEAN, COMMAND, Penumbra

TIMEOUT = 60


def test_same_bytes_for_any_workers_and_tiles(penumbra: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    for name, options in {"a": ["--workers", 1], "b": ["--workers", 2, "--tile", 5]}.items():
        assert penumbra("render", scene_file, "-o", f"{name}.png", *options).code == 0
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (48, 32)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_npy_is_linear_float32(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    assert here("render", scene_file, "-o", "a.npy", "--workers", 1).code == 0
    picture = np.load(tmp_path / "a.npy")
    assert picture.shape == (32, 48, 3)
    assert picture.dtype == np.float32


def test_png_of_16_bits(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    assert here("render", scene_file, "-o", "a.npy", "--workers", 1).code == 0
    assert here("render", scene_file, "-o", "A.PNG", "--bits", 16, "--workers", 1).code == 0
    picture, exact = read_picture(tmp_path / "A.PNG"), read_picture(tmp_path / "a.npy")
    assert (picture.bits, picture.encoding) == (16, "srgb")
    assert (np.abs(picture.linear - exact.linear) <= picture.rounding + exact.rounding).all()
    assert picture.rounding.max() < 2.0**-15
    refused = here("render", scene_file, "-o", "b.exr", "--bits", 16)
    assert refused.code == 2
    assert "--bits 16 is for .png" in refused.err
    assert not (tmp_path / "b.exr").exists()


def test_unused_alpha_is_warned_of(here: Penumbra, scene: dict[str, Any], tmp_path: Path) -> None:
    Image.new("RGBA", (2, 2), (200, 100, 50, 128)).save(tmp_path / "a.png")
    name = next(iter(scene["materials"]))
    scene["textures"] = {"clear": {"type": "image", "asset": "a.png"}}
    scene["materials"][name] = {"type": "phong", "color_texture": "clear"}
    (tmp_path / "textured.json").write_text(json.dumps(scene, indent=2))
    for words in (["render", "-o", "out.npy", "--workers", 1], ["explain"]):
        outcome = here(words[0], tmp_path / "textured.json", *words[1:])
        assert outcome.code == 0
        assert outcome.err.count("alpha is not used") == 1
        assert "/textures/clear/asset" in outcome.err
        assert '"asset": "a.png"' in outcome.err
    document = here("validate", tmp_path / "textured.json", "--json").document
    (warning,) = document["files"][0]["warnings"]
    assert (document["valid"], warning["pointer"]) == (True, "/textures/clear/asset")
    assert warning["line"] > 1


@pytest.mark.slow
def test_picture_on_stdout(scene_file: Path, here: Penumbra, tmp_path: Path) -> None:
    for target, name in (("-", "a.png"), ("-.npy", "a.npy")):
        assert here("render", scene_file, "-o", name, "--workers", 1).code == 0
        done = subprocess.run(
            [*COMMAND, "render", scene_file, "-o", target, "--workers", "1"],
            stdout=subprocess.PIPE,
            env=CLEAN | {"PYTHONPATH": str(Path(__file__).parents[3])},
            cwd=tmp_path,
            timeout=TIMEOUT,
            check=True,
        )
        assert done.stdout == (tmp_path / name).read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npy", "a.png", "scene.json"]


def test_picture_is_not_written_to_a_terminal(scene_file: Path) -> None:
    ours, terminal = os.openpty()
    done = subprocess.run(
        [*COMMAND, "render", scene_file, "-o", "-"],
        stdout=terminal,
        stderr=subprocess.PIPE,
        env=CLEAN | {"PYTHONPATH": str(Path(__file__).parents[3])},
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    os.set_blocking(ours, False)
    with pytest.raises(BlockingIOError):
        os.read(ours, 1)
    os.close(ours)
    os.close(terminal)
    assert done.returncode == 2
    assert done.stderr.startswith("error: stdout is a terminal")


def test_json_report(here: Penumbra, scene_file: Path) -> None:
    outcome = here("render", scene_file, "-o", "a.png", "--json", "--samples", 4, "--pattern", "rotated")
    report = outcome.document
    assert {"seconds", "cpu_seconds", "rays", "error", "numerics", "plan"} <= report.keys()
    assert (report["width"], report["height"]) == (48, 32)
    assert report["samples"]["antialiasing_mean"] == 4
    assert report["rays"]["camera"] == 48 * 32 * 4


def test_warning_beside_the_report(here: Penumbra, scene: dict[str, Any], scene_file: Path) -> None:
    del scene["lights"]
    scene_file.write_text(json.dumps(scene))
    outcome = here("render", scene_file, "-o", "a.png", "--json")
    assert outcome.code == 0
    assert outcome.document["rays"].get("shadow", 0) == 0
    assert "warning" in outcome.err


def test_seed_option(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    for name, seed in {"a": 1, "b": 1, "c": 2}.items():
        words = ["--seed", seed, "--pattern", "random", "--samples", 2, "--workers", 1]
        assert here("render", scene_file, "-o", f"{name}.npy", *words).code == 0
    a, b, c = (np.load(tmp_path / f"{name}.npy") for name in "abc")
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


@contextmanager
def _long_render(scene: dict[str, Any], folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A render that would take minutes, with its workers running.

    Its group of processes is its own, so that it gets signals as that of a terminal gets Ctrl-C.
    """
    scene["camera"] |= {"width": 1024, "height": 1024}
    scene["sampling"] = {"antialiasing": {"pattern": "uniform", "samples": 1024}}
    (folder / "long.json").write_text(json.dumps(scene))
    with subprocess.Popen(
        # What starts the tests in the background may have made them ignore Ctrl-C.
        ["env", "--default-signal=INT", *COMMAND, "render", "long.json", "-o", "long.png", "--workers", "2"],
        cwd=folder,
        env=CLEAN | {"PYTHONPATH": str(Path(__file__).parents[3])},
        stderr=subprocess.PIPE,
        text=True,
        process_group=0,
    ) as render:
        _wait_for(lambda: len(_at_work(render.pid)) == 2)
        try:
            yield render
        finally:
            if render.poll() is None:
                os.killpg(render.pid, signal.SIGKILL)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_interrupted_render_leaves_nothing(
    scene: dict[str, Any], tmp_path: Path, number: signal.Signals, code: int
) -> None:
    with _long_render(scene, tmp_path) as render:
        os.killpg(render.pid, number)
        _, messages = render.communicate(timeout=TIMEOUT)
    assert render.returncode == code
    assert "Traceback" not in messages
    _wait_for(lambda: not _group(render.pid))
    assert [path.name for path in tmp_path.iterdir()] == ["long.json"]


@pytest.mark.slow
def test_killed_render_leaves_no_process(scene: dict[str, Any], tmp_path: Path) -> None:
    with _long_render(scene, tmp_path) as render:
        render.kill()
        render.wait()
    _wait_for(lambda: not _group(render.pid))


def _wait_for(condition: Any) -> None:
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def _group(leader: int) -> dict[int, float]:
    """CPU seconds of the living processes of a process group, by their ids."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == leader and fields[0] != "Z":
            ticks = int(fields[11]) + int(fields[12])
            found[int(path.parent.name)] = ticks / os.sysconf("SC_CLK_TCK")
    return found


def _at_work(leader: int) -> list[int]:
    """The workers that have been busy for longer than it takes to start."""
    return [pid for pid, seconds in _group(leader).items() if pid != leader and seconds > 1.5]


@pytest.mark.parametrize("name", ["a.png", "a.npy", "a.exr"])
def test_python_saves_the_same_files(penumbra: Penumbra, scene_file: Path, tmp_path: Path, name: str) -> None:
    folder = tmp_path / "python"
    folder.mkdir()
    assert penumbra("render", scene_file, "-o", name, "--layers", "depth,shape").code == 0
    renderer.render(renderer.compile_scene(scene_file, layers=["depth", "shape"])).save(folder / name)
    saved = sorted(folder.iterdir())
    assert [file.name for file in saved] == [name, f"{name}.depth.npy", f"{name}.shape.npy"]
    for file in saved:
        assert file.read_bytes() == (tmp_path / file.name).read_bytes()
