"""A build forbids skipped tests: what they need is installed there."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.sources import ROOT
from tests.conftest import SKIPS_FORBIDDEN

TESTS = """
import pytest

@pytest.fixture
def program():
    pytest.skip("there is no such program")

def test_of_a_program(program):
    pass

@pytest.mark.skipif(True, reason="this system has no such file")
def test_of_a_file():
    pass

@pytest.mark.xfail(strict=True)
def test_of_a_known_fault():
    assert False

def test_of_nothing():
    pass
"""


@pytest.mark.parametrize(
    ("forbidden", "code", "outcome"),
    [("", 0, "1 passed, 2 skipped, 1 xfailed"), ("1", 1, "1 passed, 1 xfailed, 2 errors")],
    ids=["allowed", "forbidden"],
)
def test_a_skipped_test_has_failed_where_that_is_forbidden(
    forbidden: str, code: int, outcome: str, tmp_path: Path
) -> None:
    (tmp_path / "test_some.py").write_text(TESTS)
    command = [sys.executable, "-m", "pytest", "-p", "tests.conftest", "-p", "no:cacheprovider", "-q"]
    command += ["--config-file", os.devnull, "--rootdir", str(tmp_path), str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": str(ROOT), SKIPS_FORBIDDEN: forbidden}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stdout.splitlines()[-1].partition(" in ")[0]) == (code, outcome), (
        done.stdout
    )
    if forbidden:
        assert "there is no such program. SKIPS_FORBIDDEN is set" in done.stdout
        assert "this system has no such file. SKIPS_FORBIDDEN is set" in done.stdout


def test_the_build_forbids_skipped_tests() -> None:
    assert f"export {SKIPS_FORBIDDEN}=1" in (ROOT / ".ci" / "run").read_text()
