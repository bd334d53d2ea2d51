"""The commands of the client against a running service."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.acceptance.conftest import COMMAND, ENVIRONMENT, Penumbra, Server

pytestmark = pytest.mark.slow


def test_a_submitted_scene_gives_the_same_bytes_as_rendering_it_here(
    penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    assert penumbra("render", scene_file, "-o", "here.png").code == 0
    assert penumbra("render", scene_file, "-o", "here.npy", "--workers", 1, "--tile", 7).code == 0
    sent = penumbra("submit", scene_file, "-o", "sent.png")
    assert sent.code == 0
    assert penumbra("get", sent.out.strip(), "-o", "sent.npy").code == 0
    for name in ("png", "npy"):
        assert (tmp_path / f"sent.{name}").read_bytes() == (tmp_path / f"here.{name}").read_bytes()


def test_layers_of_a_submitted_scene_are_the_same_as_here(
    penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    words = ["--layers", "depth,normal"]
    assert penumbra("render", scene_file, "-o", "here.exr", *words).code == 0
    sent = penumbra("submit", scene_file, "-o", "sent.exr", *words)
    assert sent.code == 0
    assert penumbra("get", sent.out.strip(), "-o", "got.png", "--layers", "depth").code == 0
    refused = penumbra("get", sent.out.strip(), "-o", "none.png", "--layers", "depth,uv")
    assert refused.code == 2
    assert "no layer uv" in refused.err
    assert "depth, normal" in refused.err
    assert not (tmp_path / "none.png").exists()
    assert (tmp_path / "sent.exr").read_bytes() == (tmp_path / "here.exr").read_bytes()
    for name in ("depth", "normal"):
        assert (tmp_path / f"sent.exr.{name}.npy").read_bytes() == (
            tmp_path / f"here.exr.{name}.npy"
        ).read_bytes()
    assert (tmp_path / "got.png.depth.npy").read_bytes() == (tmp_path / "here.exr.depth.npy").read_bytes()
    assert not (tmp_path / "got.png.uv.npy").exists()


def test_refusals_point_into_the_users_own_file_and_options(
    penumbra: Penumbra, scene_file: Path, scene: dict[str, Any], tmp_path: Path
) -> None:
    label = "name:" + "x" * 300
    refused = penumbra("submit", scene_file, "--label", label)
    assert (refused.code, refused.out) == (2, "")
    assert refused.err.startswith("error: --label: This text is too long")
    document = penumbra("submit", scene_file, "--label", label, "--json").document
    assert [(error["pointer"], "line" in error) for error in document["errors"]] == [("/labels/name", False)]
    scene["camera"]["widht"] = 3
    scene_file.write_text(json.dumps(scene, indent=2))
    both = penumbra("submit", scene_file, "--label", label)
    assert both.code == 3
    line = scene_file.read_text().split('"widht"')[0].count("\n") + 1
    assert f"/camera/widht  line {line}, column 5" in both.err
    assert "error --label\n" in both.err
    assert max(map(len, both.err.splitlines())) < 400


def test_submit_prints_the_id_alone_and_the_job_can_be_waited_for(
    penumbra: Penumbra, scene_file: Path
) -> None:
    submitted = penumbra("submit", scene_file)
    assert submitted.code == 0
    job_id = submitted.out.strip()
    assert job_id.isalnum()
    waited = penumbra("wait", job_id, "--json")
    assert waited.code == 0
    assert waited.document["state"] == "succeeded"
    assert waited.document["id"] == job_id


def test_watching_on_a_pipe_prints_each_tile_once_in_order_and_again_from_the_start(
    penumbra: Penumbra, scene_file: Path
) -> None:
    job_id = penumbra("submit", scene_file).out.strip()
    first, second = penumbra("watch", job_id), penumbra("watch", job_id)
    tiles = [line for line in first.out.splitlines() if "\ttile " in line]
    numbers = [int(line.partition("/")[0]) for line in tiles]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) > 1
    assert [line for line in second.out.splitlines() if "\ttile " in line] == tiles
    assert first.code == second.code == 0


def cells(line: str) -> list[str]:
    return line.split("\t")


def test_watching_on_a_pipe_prints_each_finished_pass_and_then_its_error(
    penumbra: Penumbra, scene_file: Path
) -> None:
    job_id = penumbra("submit", scene_file, "--target-error", 0.01).out.strip()
    outcome = penumbra("watch", job_id)
    saved = penumbra("get", job_id, "--convergence", "curve.json")
    assert (outcome.code, saved.code, saved.out) == (0, 0, "")
    lines = outcome.out.splitlines()
    passes = [cells(line) for line in lines if line.startswith("pass ")]
    assert [words[0] for words in passes] == [f"pass {index} done" for index in range(len(passes))]
    assert [len(words) for words in passes] == [5] * len(passes)
    # Between its last tile and the first one of the next pass.
    for index in range(len(passes) - 1):
        place = lines.index("\t".join(passes[index]))
        assert f"\tpass {index}\t" in lines[place - 1]
        assert f"\tpass {index + 1}\t" in lines[place + 1]
    error = penumbra("get", job_id, "--json").document["error"]
    assert passes[-1][4] == f"error {error['estimate']:.2g} ({error['low']:.2g} to {error['high']:.2g})"
    after = lines[lines.index("\t".join(passes[-1])) + 1 :]
    assert after[0].startswith(passes[-1][4])


def test_the_curve_of_a_job_is_saved_in_the_form_of_the_ending(
    penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    job_id = penumbra("submit", scene_file, "--wait").out.strip()
    for ending, begins in {
        "json": b'{"job":',
        "csv": b"pass_index,",
        "svg": b"<?xml",
        "PNG": b"\x89PNG",
    }.items():
        assert penumbra("get", job_id, "--convergence", f"curve.{ending}").code == 0
        assert (tmp_path / f"curve.{ending}").read_bytes().startswith(begins)
    assert json.loads((tmp_path / "curve.json").read_text())["job"] == job_id
    assert penumbra("get", job_id, "--convergence", "curve.pdf").code == 2


def test_quality_options_count_for_a_submitted_scene_too(
    penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    options = ["--samples", 9, "--pattern", "rotated", "--light-samples", 1, "--precision", "double"]
    assert penumbra("render", scene_file, "-o", "here.npy", *options).code == 0
    assert penumbra("submit", scene_file, "-o", "sent.npy", *options).code == 0
    assert penumbra("render", scene_file, "-o", "plain.npy").code == 0
    here, sent, plain = (np.load(tmp_path / f"{name}.npy") for name in ("here", "sent", "plain"))
    assert np.array_equal(here, sent)
    assert not np.array_equal(here, plain)


def test_the_newest_job_is_listed_first(penumbra: Penumbra, scene_file: Path) -> None:
    ids = [penumbra("submit", scene_file).out.strip() for _ in range(2)]
    listed = penumbra("ls", "--limit", 2, "--json").document["jobs"]
    assert [job["id"] for job in listed] == ids[::-1]
    lines = penumbra("ls", "--limit", 2).out.splitlines()
    assert [line.split("\t")[0] for line in lines] == ids[::-1]


def test_a_fresh_picture_is_rendered_again_and_a_priority_is_that_of_the_job(
    penumbra: Penumbra, scene_file: Path
) -> None:
    first = penumbra("submit", scene_file, "--wait", "--json").document
    stored = penumbra("submit", scene_file, "--json").document
    fresh = penumbra("submit", scene_file, "--wait", "--fresh", "--priority", -3, "--json").document
    assert [job["state"] for job in (first, stored, fresh)] == ["succeeded"] * 3
    # What was measured is never the same twice.
    assert stored["cost"] == first["cost"]
    assert fresh["cost"]["cpu_seconds"] != first["cost"]["cpu_seconds"]
    assert [job["priority"] for job in (stored, fresh)] == [0, -3]


def test_deleted_jobs_are_gone_and_one_that_is_not_there_is_named(
    penumbra: Penumbra, scene_file: Path
) -> None:
    one, two = (penumbra("submit", scene_file).out.strip() for _ in range(2))
    deleted = penumbra("delete", one, "nothing", two, one, "--json")
    assert (deleted.code, deleted.document) == (4, {"deleted": [one, two], "missing": ["nothing"]})
    assert penumbra("get", one).code == 4
    three = penumbra("submit", scene_file).out.strip()
    said = penumbra("delete", three)
    assert (said.code, said.out, said.err) == (0, "", f"Job {three} is deleted.\n")


def test_a_submitted_image_on_stdout_is_alone_there(
    penumbra: Penumbra, server: Server, scene_file: Path, tmp_path: Path
) -> None:
    assert penumbra("submit", scene_file, "-o", "a.png").code == 0
    done = subprocess.run(
        [*COMMAND, "submit", scene_file, "-o", "-"],
        capture_output=True,
        env=ENVIRONMENT | {"PENUMBRA_SERVER": server.url},
        cwd=tmp_path,
        timeout=120,
        check=True,
    )
    assert done.stdout == (tmp_path / "a.png").read_bytes()


def test_a_cancelled_job_has_no_image(penumbra: Penumbra, endless_file: Path, tmp_path: Path) -> None:
    job_id = penumbra("submit", endless_file).out.strip()
    assert penumbra("cancel", job_id).code == 0
    assert penumbra("wait", job_id).code == 4
    assert penumbra("get", job_id, "--json").document["state"] == "cancelled"
    assert penumbra("get", job_id, "-o", "no.png").code == 4
    assert not (tmp_path / "no.png").exists()


def test_a_time_out_names_the_job_and_the_job_goes_on(penumbra: Penumbra, endless_file: Path) -> None:
    timed_out = penumbra("submit", endless_file, "--wait", "--timeout", 0.5, "--json")
    assert timed_out.code == 5
    job_id = timed_out.document["job_id"]
    assert penumbra("wait", job_id, "--timeout", 0.1).code == 5
    assert penumbra("get", job_id, "--json").document["state"] in {"queued", "running"}
    assert penumbra("cancel", job_id).code == 0


def test_of_a_running_job_there_is_a_picture_already(
    penumbra: Penumbra, endless_file: Path, tmp_path: Path
) -> None:
    job_id = penumbra("submit", endless_file).out.strip()
    partial = penumbra("get", job_id, "-o", "part.npy")
    penumbra("cancel", job_id)
    assert partial.code == 0
    assert "so far" in partial.err
    picture = np.load(tmp_path / "part.npy")
    assert picture.shape == (512, 512, 3)
    assert picture.max() > 0


def test_what_the_service_refuses_is_shown_in_the_users_own_file(
    penumbra: Penumbra, scene: dict[str, Any], scene_file: Path
) -> None:
    scene["camera"]["vertical_fov"] = 180
    scene["shapes"][0]["materiel"] = "x"
    scene_file.write_text(json.dumps(scene, indent=2))
    lines = scene_file.read_text().splitlines()
    here, sent = penumbra("validate", scene_file, "--json"), penumbra("submit", scene_file, "--json")
    assert here.code == sent.code == 3
    assert sent.document["errors"] == here.document["files"][0]["errors"]
    places = {error["pointer"]: lines[error["line"] - 1] for error in sent.document["errors"]}
    assert '"vertical_fov"' in places["/camera/vertical_fov"]
    assert '"materiel"' in places["/shapes/0/materiel"]


def test_an_unknown_job_is_an_error_of_the_server(penumbra: Penumbra, server: Server) -> None:
    for words in (["get", "none"], ["wait", "none"], ["cancel", "none"], ["get", "../../livez"]):
        outcome = penumbra(*words)
        assert outcome.code == 4
        assert outcome.err.startswith("error: ")


def test_a_picture_of_target_quality_is_the_same_here_and_there(
    penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    words = ["--target-error", 0.05]
    here = penumbra("render", scene_file, "-o", "here.npy", "--json", *words)
    sent = penumbra("submit", scene_file, "-o", "sent.npy", "--json", *words)
    assert (here.code, sent.code) == (0, 0)
    assert sent.document["error"] == here.document["error"]
    assert (tmp_path / "sent.npy").read_bytes() == (tmp_path / "here.npy").read_bytes()


def test_the_log_of_a_job_has_a_line_for_each_event(
    penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    document = json.loads(scene_file.read_text())
    # The same scene would share the picture of another test.
    document["sampling"] = document.get("sampling", {}) | {"seed": 203}
    own = tmp_path / "own.json"
    own.write_text(json.dumps(document))
    job_id = penumbra("submit", own, "--wait").out.strip()
    lines = [line.split("\t") for line in penumbra("logs", job_id).out.splitlines()]
    assert {len(line) for line in lines} == {3}
    assert [line[1] for line in lines][:2] == ["submitted", "started"]
    assert lines[-1][1] == "succeeded"
    printed = penumbra("logs", job_id, "--json").document
    assert (printed["job"], [entry["event"] for entry in printed["entries"]]) == (
        job_id,
        [line[1] for line in lines],
    )
    assert penumbra("logs", "none").code == 4


def test_submitted_scene_has_the_size_of_the_options(
    penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    options = ["--scale", 0.5, "--crop", "2,3,8,5"]
    assert penumbra("submit", scene_file, "-o", "sent.npy", *options).code == 0
    assert penumbra("render", scene_file, "-o", "rendered.npy", *options).code == 0
    assert (tmp_path / "sent.npy").read_bytes() == (tmp_path / "rendered.npy").read_bytes()


def test_problems_of_a_resized_scene_are_shown_in_its_file(
    penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    text = scene_file.read_text().replace('"material"', '"materiel"', 1)
    (tmp_path / "misspelt.json").write_text(text)
    refused = penumbra("submit", "misspelt.json", "--scale", 0.5)
    assert refused.code == 3
    line = 1 + text[: text.index("materiel")].count("\n")
    assert f"line {line}," in refused.err
