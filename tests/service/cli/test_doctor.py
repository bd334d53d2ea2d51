from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from service.cli.doctor import Check, _service
from service.cli.errors import ExitCode
from tests.service.cli.conftest import Penumbra

NAMES = {"penumbra", "python", "libraries", "numpy simd", "processors", "memory", "data folder", "database"}


@pytest.mark.slow
def test_everything_is_checked_and_nothing_is_made(penumbra: Penumbra, tmp_path: Path) -> None:
    outcome = penumbra("doctor", "--json")
    assert outcome.code == 0
    checks = {check["name"]: check for check in outcome.document["checks"]}
    assert checks.keys() >= NAMES
    assert str(tmp_path) in checks["data folder"]["found"]
    assert "the default" in checks["data folder"]["found"]
    assert list(tmp_path.iterdir()) == []


def test_a_variable_that_is_no_setting_is_reported_with_what_was_meant(
    here: Penumbra, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("PENUMBRA_WORKER", "PENUMBRA_LIMITS__MAX_PIXEL", "penumbra_prot", "PENUMBRA_XYZ"):
        monkeypatch.setenv(name, "s3cret")
    for name in ("PENUMBRA_LIMITS__MAX_LIGHTS", "PENUMBRA_PORT", "penumbra_workers"):
        monkeypatch.setenv(name, "2")
    for name in ("PENUMBRA_SERVER", "PENUMBRA_KEY"):
        monkeypatch.setenv(name, "x")
    outcome = here("doctor", "--json")
    checks = [check for check in outcome.document["checks"] if check["name"] == "variable"]
    meant = {check["found"]: re.findall(r"PENUMBRA_\w+", check["advice"]) for check in checks}
    assert meant == {
        "PENUMBRA_LIMITS__MAX_PIXEL": ["PENUMBRA_LIMITS__MAX_PIXELS"],
        "PENUMBRA_WORKER": ["PENUMBRA_WORKERS"],
        "PENUMBRA_XYZ": [],
        "penumbra_prot": ["PENUMBRA_PORT"],
    }
    assert "s3cret" not in outcome.out + outcome.err


def test_extras_of_developers_are_nothing_to_warn_of(here: Penumbra) -> None:
    names = {check["name"] for check in here("doctor", "--json").document["checks"]}
    assert "[exr]" in names
    assert names.isdisjoint({"[test]", "[check]", "[docs]", "[bench]"})


def _checks() -> dict[str, Check]:
    return {check.name: check for check in _service()}


def test_a_folder_that_cannot_be_made_is_a_failure_with_its_source(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("PENUMBRA_DATA", str(tmp_path / "file" / "data"))
    check = _checks()["data folder"]
    assert check.level == "fail"
    assert "PENUMBRA_DATA" in check.found + check.advice


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://me:s3cret@127.0.0.1:9/x",
        "postgresql://me@127.0.0.1:9/x?password=s3cret&sslpassword=s3cret",
        "postgresql://me:s3cret@127.0.0.1:port/x",
        "postgresql://me:s3cret@127.0.0.1:9/x?no_such_option=1",
        "mysql://me:s3cret@127.0.0.1/x",
        "me:s3cret@127.0.0.1/x",
    ],
)
@pytest.mark.parametrize("form", [(), ("--json",)], ids=["for people", "as JSON"])
@pytest.mark.parametrize("place", ["variable", "file"])
def test_no_password_is_shown_however_it_is_given(
    here: Penumbra,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    url: str,
    form: tuple[str, ...],
    place: str,
) -> None:
    (tmp_path / "p.toml").write_text(f'database = "{url}"\n')
    reported = ("PENUMBRA_CONFIG", "p.toml") if place == "file" else ("PENUMBRA_DATABASE", url)
    monkeypatch.setenv(*reported)
    outcome = here("doctor", *form)
    assert "s3cret" not in outcome.out + outcome.err
    assert outcome.code == ExitCode.SERVER
    assert ("p.toml" if place == "file" else "PENUMBRA_DATABASE") in outcome.out


def test_a_bucket_that_does_not_answer_is_a_failure_with_its_source(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PENUMBRA_STORE", "s3://pictures/here")
    for name, value in {"ENDPOINT_URL": "http://127.0.0.1:9", "ACCESS_KEY_ID": "a"}.items():
        monkeypatch.setenv(f"AWS_{name}", value)
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
    check = _checks()["store"]
    assert check.level == "fail"
    assert "PENUMBRA_STORE" in check.found
    assert "AWS_ENDPOINT_URL" in check.advice
    assert "secret" not in check.advice


@pytest.mark.parametrize("address", ["file:///srv", "s3:/pictures", "s3://", "pictures"])
def test_an_address_that_names_no_bucket_is_a_failure(monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    monkeypatch.setenv("PENUMBRA_STORE", address)
    assert {check.level for check in _service()} == {"fail"}


def test_where_traces_go_is_reported_without_what_may_be_secret(
    here: Penumbra, monkeypatch: pytest.MonkeyPatch
) -> None:
    variable = "OTEL_EXPORTER_OTLP_ENDPOINT"
    monkeypatch.delenv(variable, raising=False)
    assert "not sent" in _traces(here)
    monkeypatch.setenv(variable, "https://me:s3cret@collector:4318/s3cret?key=s3cret")
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_HEADERS", "authorization=s3cret")
    assert _traces(here) == f"sent to https://collector:4318 (from {variable})"
    monkeypatch.setenv("OTEL_SDK_DISABLED", "true")
    assert "not sent" in _traces(here)


def _traces(here: Penumbra) -> str:
    outcome = here("doctor", "--json")
    assert "s3cret" not in outcome.out + outcome.err
    (check,) = (check for check in outcome.document["checks"] if check["name"] == "traces")
    found: str = check["found"]
    return found


@pytest.mark.parametrize("name", ["PENUMBRA_PORT", "PENUMBRA_WORKERS"])
def test_settings_that_make_no_sense_are_a_failure(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setenv(name, "many")
    assert {check.level for check in _service()} == {"fail"}


def test_numerics_are_right_here(here: Penumbra) -> None:
    outcome = here("doctor", "--numerics", "--json")
    assert outcome.code == ExitCode.DONE
    assert all(case["right"] and not case["error"] for case in outcome.document["cases"])
    assert outcome.document["total"]["cases"] == len(outcome.document["cases"]) >= 20
    lines = here("doctor", "--numerics").out.splitlines()
    assert [line.split(maxsplit=1)[0] for line in lines[:-1]] == ["ok"] * (len(lines) - 1)


FAULTS = {
    "rounding upwards": (
        (
            "import ctypes, platform; numpy.float64(1)\n"
            "upwards = 0x400000 if platform.machine() in ('aarch64', 'arm64') else 0x800\n"
            "assert ctypes.CDLL(None).fesetround(upwards) == 0"
        ),
        {"float64 rounds to nearest, ties to even", "float32 rounds to nearest, ties to even"},
    ),
    "a cosine that is not clamped": (
        (
            "from renderer.materials import optics\n"
            "optics.transmitted_cosine = lambda c, n: numpy.sqrt((1 - n) * (1 + n) + (n * c) ** 2)"
        ),
        {"total reflection"},
    ),
    "a function that raises": (
        (
            "from accuracy import self_test\n"
            "def broken(values): raise ZeroDivisionError('no sum')\n"
            "self_test.halving_sum = broken"
        ),
        {"a million samples"},
    ),
}


@pytest.mark.parametrize(("fault", "wrong"), FAULTS.values(), ids=FAULTS)
def test_numerics_report_a_fault(fault: str, wrong: set[str]) -> None:
    run = "from service.cli.main import main; main(['doctor', '--numerics', '--json'])"
    source = f"import numpy; import accuracy.self_test\n{fault}\n{run}"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", source],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == ExitCode.BELOW_THRESHOLD, done.stderr
    found = {case["name"]: case for case in json.loads(done.stdout)["cases"] if not case["right"]}
    assert found.keys() >= wrong
    assert all(case["cure"] for case in found.values())
    assert len(found) == 1 or "rounds" in next(iter(found))
