"""The commands of the client against a running service, and how that starts and stops."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.client import Client
from service.server import RunningServer
from tests.service import support
from tests.service.cli.conftest import ENVIRONMENT, TIMEOUT, Penumbra, begun, ended
from tests.service.processes import is_alive, workers_of
from tests.service.support import until
from tests.tev_server import CREATE, UPDATE_V3, TevServer


@pytest.fixture
def penumbra(here: Penumbra, server: RunningServer, monkeypatch: pytest.MonkeyPatch) -> Penumbra:
    """Run the command in this process, with the shared service as its server."""
    monkeypatch.setenv("PENUMBRA_SERVER", server.url)
    return here


@pytest.fixture
def endless_file(tmp_path: Path) -> Path:
    """A scene that takes far longer than any test, and less than the service allows."""
    path = tmp_path / "endless.json"
    path.write_text(json.dumps(support.scene(512, 512, samples=256)))
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ending", "options"),
    [
        ("exr", ["--layers", "depth,normal"]),
        ("npy", ["--target-error", 0.05, "--scale", 0.5, "--crop", "2,3,8,5"]),
        ("npy", ["--samples", 9, "--pattern", "rotated", "--light-samples", 1, "--precision", "double"]),
    ],
    ids=["layers", "target and size", "samples"],
)
def test_submit_gives_the_bytes_of_render(
    ending: str, options: list[object], penumbra: Penumbra, scene_file: Path, tmp_path: Path
) -> None:
    assert penumbra("render", scene_file, "-o", f"here.{ending}", "--tile", 7, *options).code == 0
    assert penumbra("submit", scene_file, "-o", f"sent.{ending}", *options).code == 0
    made = sorted(tmp_path.glob("here.*"))
    assert len(made) == (3 if ending == "exr" else 1)
    for path in made:
        assert path.with_name(path.name.replace("here", "sent")).read_bytes() == path.read_bytes()


def test_jobs_are_listed_by_label_and_deleted(penumbra: Penumbra, scene_file: Path) -> None:
    mine = ["--label", "course:cs171", "--label", "due:12:30"]
    first = penumbra("submit", scene_file, *mine, "--wait").out.strip()
    second = penumbra("submit", scene_file, *mine).out.strip()
    other = penumbra("submit", scene_file, "--label", "course:other").out.strip()
    # Several values of a name are any of them.
    both = penumbra("ls", "--label", "course:cs171", "--label", "course:other", "--json").document["jobs"]
    assert [job["id"] for job in both[:3]] == [other, second, first]
    twice = penumbra("submit", scene_file, "--label", "course:a", "--label", "course:b")
    assert (twice.code, "--label course" in twice.err) == (2, True)
    assert [job["id"] for job in penumbra("ls", *mine, "--json").document["jobs"]] == [second, first]
    found = penumbra("ls", "--search", "COURSE:oth", "--json").document["jobs"]
    assert [job["id"] for job in found] == [other]
    page = penumbra("ls", *mine, "--limit", 1)
    rest = penumbra("ls", *mine, "--after", page.err.strip().rpartition(" ")[2])
    assert [line.split("\t")[0] for line in (page.out, rest.out)] == [second, first]
    deleted = penumbra("delete", first, "nothing", other, "--json")
    assert (deleted.code, deleted.document) == (4, {"deleted": [first, other], "missing": ["nothing"]})
    assert penumbra("get", first).code == 4


def test_fresh_render_is_measured_again(penumbra: Penumbra, scene_file: Path) -> None:
    first = penumbra("submit", scene_file, "--wait", "--json").document
    stored = penumbra("submit", scene_file, "--json").document
    fresh = penumbra("submit", scene_file, "--wait", "--fresh", "--priority", -3, "--json").document
    assert stored["cost"] == first["cost"] != fresh["cost"]
    assert [job["priority"] for job in (stored, fresh)] == [0, -3]


def test_watch_prints_tiles_and_passes_in_order(penumbra: Penumbra, scene_file: Path) -> None:
    job = penumbra("submit", scene_file, "--target-error", 0.01).out.strip()
    lines = penumbra("watch", job).out.splitlines()
    tiles = [int(line.partition("/")[0]) for line in lines if "\ttile " in line]
    assert tiles == [*range(1, len(tiles) + 1)]
    passes = [line.split("\t") for line in lines if line.startswith("pass ")]
    assert [words[0] for words in passes] == [f"pass {index} done" for index in range(len(passes))]
    assert passes[-1][4].startswith("error ")
    events = [line.split("\t")[1] for line in penumbra("logs", job).out.splitlines()]
    assert (events[:2], events[-1]) == (["submitted", "started"], "succeeded")


def test_running_job_has_a_picture_times_out_and_is_cancelled(
    penumbra: Penumbra, endless_file: Path, tmp_path: Path
) -> None:
    timed_out = penumbra("submit", endless_file, "--wait", "--timeout", 0.5, "--json")
    job = timed_out.document["job_id"]
    assert timed_out.code == 5
    # A loaded machine may have no pixel yet.
    until(lambda: penumbra("get", job, "-o", "part.npy").code == 0, TIMEOUT)
    assert "so far" in penumbra("get", job, "-o", "part.npy").err
    assert np.load(tmp_path / "part.npy").max() > 0
    assert penumbra("cancel", job).code == 0
    assert penumbra("get", job, "--json").document["state"] == "cancelled"
    assert penumbra("get", job, "-o", "no.png").code == 4
    assert not (tmp_path / "no.png").exists()


def test_refusal_points_into_the_users_file(
    penumbra: Penumbra, scene: dict[str, Any], scene_file: Path
) -> None:
    scene["camera"]["vertical_fov"] = 180
    scene["shapes"][0]["materiel"] = "x"
    scene_file.write_text(json.dumps(scene, indent=2))
    local = penumbra("validate", scene_file, "--json")
    for options in ([], ["--scale", 0.5]):
        sent = penumbra("submit", scene_file, "--json", *options)
        assert local.code == sent.code == 3
        assert sent.document["errors"] == local.document["files"][0]["errors"]
    assert {error["pointer"] for error in sent.document["errors"]} == {
        "/camera/vertical_fov",
        "/shapes/0/materiel",
    }


def test_tev_shows_the_picture_and_may_go_away(
    penumbra: Penumbra, server: RunningServer, scene_file: Path
) -> None:
    job = penumbra("submit", scene_file).out.strip()
    tev, leaving = TevServer(), TevServer(packets=1)
    watched = [penumbra("watch", job, "--tev", each.address) for each in (tev, leaving)]
    for each in (tev, leaving):
        each.close()
    assert [outcome.code for outcome in watched] == [0, 0]
    with Client(server.url) as client:
        np.testing.assert_array_equal(tev.picture(f"penumbra {job}"), client.pixels(job))
    assert (tev.kinds[0], {*tev.kinds[1:]}, leaving.kinds) == (CREATE, {UPDATE_V3}, [CREATE])


def test_ctrl_c_while_waiting_names_the_job(server: RunningServer, endless_file: Path) -> None:
    script = (
        "import sys; from service.client import Client; job = Client(sys.argv[1]).submit(sys.argv[2]); "
        "job.wait(on_progress=lambda batch: print(job.id, flush=True))"
    )
    words = [sys.executable, "-c", script, server.url, str(endless_file)]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True, env=ENVIRONMENT) as waiting:
        assert waiting.stdout is not None
        job = waiting.stdout.readline().strip()
        waiting.send_signal(signal.SIGINT)
        _, err = waiting.communicate(timeout=TIMEOUT)
    assert waiting.returncode == -signal.SIGINT
    assert f"client.wait('{job}')" in err
    with Client(server.url) as client:
        assert client.get(job).cancel().state == "cancelled"


@pytest.mark.slow
def test_service_has_its_port_and_folder_alone_and_leaves_no_process(tmp_path: Path) -> None:
    with begun(tmp_path, "serve", "--port", 0, "--data", "data", "--workers", 2) as serving:
        assert serving.stderr is not None
        (port,) = next(found for line in serving.stderr if (found := re.findall(r"127\.0\.0\.1:(\d+)", line)))
        for words in (["--port", port, "--data", "other"], ["--port", 0, "--data", "data"]):
            outcome = ended(tmp_path, "serve", *words)
            assert (outcome.code, outcome.out) == (4, "")
            assert "could not start" in outcome.err
        workers = workers_of(serving.pid)
        serving.terminate()
        serving.communicate()
    assert workers
    assert serving.returncode == 0
    until(lambda: not any(map(is_alive, workers)), TIMEOUT)
