from __future__ import annotations

import signal
import subprocess
from pathlib import Path

import httpx2
import pytest
from PIL import Image

from tests.acceptance.conftest import COMMAND, ENVIRONMENT, Outcome

pytestmark = pytest.mark.slow


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """One in which all temporary files are made in a folder of the test."""
    (tmp_path / "temporary").mkdir()
    return ENVIRONMENT | {"TMPDIR": str(tmp_path / "temporary")}


def test_demo_writes_the_picture_and_leaves_nothing(tmp_path: Path, environment: dict[str, str]) -> None:
    done = subprocess.run(
        [*COMMAND, "demo", "--json"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment,
        timeout=400,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    document = Outcome(done.returncode, done.stdout, done.stderr).document
    assert document["job"]["state"] == "succeeded"
    assert document["first_pixels_seconds"] < document["seconds"]
    assert "tile " in done.stderr
    assert document["page"].endswith(f"/jobs/{document['job']['id']}")
    *_, address, hint = done.stderr.splitlines()
    assert address == f"The page of the job was {document['page']}"
    assert "--keep" in hint
    with Image.open(tmp_path / "out" / "demo.png") as picture:
        assert picture.size == (document["job"]["width"], document["job"]["height"])
    _assert_nothing_left(tmp_path)


def test_kept_demo_serves_its_page_until_ctrl_c(tmp_path: Path, environment: dict[str, str]) -> None:
    with subprocess.Popen(
        ["env", "--default-signal=INT", *COMMAND, "demo", "--keep"],
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=environment,
    ) as demo:
        assert demo.stderr is not None
        page = next(line.split()[-1] for line in demo.stderr if line.startswith("The page of the job is"))
        assert httpx2.get(page).headers["Content-Type"].startswith("text/html")
        job = httpx2.get(page.replace("/jobs/", "/v1/jobs/")).json()
        assert job["state"] == "succeeded"
        next(line for line in demo.stderr if "Ctrl-C" in line)
        demo.send_signal(signal.SIGINT)
        demo.stderr.read()
    assert demo.returncode == 0
    _assert_nothing_left(tmp_path)


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["ctrl-c", "terminated"]
)
def test_interrupted_demo_leaves_nothing(
    tmp_path: Path, environment: dict[str, str], number: signal.Signals, code: int
) -> None:
    # A shell that starts the tests in the background may make them ignore Ctrl-C.
    with subprocess.Popen(
        ["env", "--default-signal=INT", *COMMAND, "demo"],
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=environment,
    ) as demo:
        assert demo.stderr is not None
        # Once: an interrupted line may be written again, and a second signal ends the demo at once.
        next(line for line in demo.stderr if "tiles arrive" in line)
        demo.send_signal(number)
        demo.stderr.read()
    assert demo.returncode == code
    assert list((tmp_path / "out").iterdir()) == []
    _assert_nothing_left(tmp_path)


def _assert_nothing_left(folder: Path) -> None:
    assert list((folder / "temporary").iterdir()) == []
    # Every process that the demo starts has its temporary folder in its environment.
    ours = f"TMPDIR={folder / 'temporary'}".encode()
    for process in Path("/proc").glob("[0-9]*/environ"):
        try:
            assert ours not in process.read_bytes().split(b"\0"), process.with_name("cmdline").read_bytes()
        except OSError:
            continue
