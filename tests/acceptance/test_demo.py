import signal
from contextlib import suppress
from pathlib import Path

import httpx2
import pytest

from tests.service.cli.conftest import begun

pytestmark = pytest.mark.slow


@pytest.fixture
def temporary(tmp_path: Path) -> Path:
    """A folder for all temporary files of a command."""
    (tmp_path / "temporary").mkdir()
    return tmp_path / "temporary"


def assert_nothing_left(temporary: Path) -> None:
    assert list(temporary.iterdir()) == []
    # Every process that the demo starts has its temporary folder in its environment.
    ours = f"TMPDIR={temporary}".encode()
    for process in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            assert ours not in process.read_bytes().split(b"\0"), process.with_name("cmdline").read_bytes()


def test_kept_demo_serves_its_page_until_ctrl_c(tmp_path: Path, temporary: Path) -> None:
    with begun(tmp_path, "demo", "--keep", TMPDIR=str(temporary)) as demo:
        assert demo.stderr is not None
        page = next(line.split()[-1] for line in demo.stderr if line.startswith("The page of the job is"))
        assert httpx2.get(page).headers["Content-Type"].startswith("text/html")
        assert httpx2.get(page.replace("/jobs/", "/v1/jobs/")).json()["state"] == "succeeded"
        next(line for line in demo.stderr if "Ctrl-C" in line)
        demo.send_signal(signal.SIGINT)
        demo.stderr.read()
    assert demo.returncode == 0
    assert_nothing_left(temporary)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_interrupted_demo_leaves_nothing(
    tmp_path: Path, temporary: Path, number: signal.Signals, code: int
) -> None:
    with begun(tmp_path, "demo", TMPDIR=str(temporary)) as demo:
        assert demo.stderr is not None
        # Once: an interrupted line may be written again, and a second signal ends the demo at once.
        next(line for line in demo.stderr if "tiles arrive" in line)
        demo.send_signal(number)
        demo.stderr.read()
    assert demo.returncode == code
    assert list((tmp_path / "out").iterdir()) == []
    assert_nothing_left(temporary)
