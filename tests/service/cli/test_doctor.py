import re
import sys
from pathlib import Path

import numpy as np
import pytest

from accuracy import self_test
from renderer.materials import optics
from service.cli.doctor import Check, _service
from service.cli.errors import ExitCode
from service.server import RunningServer
from service.settings import Settings
from tests.service.cli.conftest import Outcome, Penumbra, ended

NAMES = {"penumbra", "python", "libraries", "numpy simd", "processors", "memory", "data folder", "database"}


def service_checks() -> dict[str, Check]:
    return {check.name: check for check in _service()}


def test_everything_is_checked_and_nothing_is_made(here: Penumbra, tmp_path: Path) -> None:
    outcome = here("doctor", "--json")
    assert outcome.code == 0
    checks = {check["name"]: check for check in outcome.document["checks"]}
    assert checks.keys() >= NAMES | {"[exr]"}
    assert checks.keys().isdisjoint({"[test]", "[check]"})
    assert str(tmp_path) in checks["data folder"]["found"]
    assert "the default" in checks["data folder"]["found"]
    assert list(tmp_path.iterdir()) == []
    assert len(here("doctor").out.splitlines()) >= len(checks)


def test_setting_with_its_source(here: Penumbra, tmp_path: Path) -> None:
    database = "postgresql://me:secret@localhost/x"
    (tmp_path / "p.toml").write_text(f'database = "{database}"\n[limits]\nmax_lights = 7\n')
    document = here("doctor", "--config", "p.toml", "--json").document
    settings = {setting["name"]: (setting["value"], setting["source"]) for setting in document["settings"]}
    assert settings["limits.max_lights"] == ("7", "p.toml")
    assert settings["port"] == ("8000", "default")
    assert settings["database"] == (database.replace("secret", "***"), "p.toml")
    assert set(Settings.model_fields) - {"limits"} == {name for name in settings if "." not in name}


def test_misspelt_variable_is_reported_with_what_was_meant(
    here: Penumbra, monkeypatch: pytest.MonkeyPatch
) -> None:
    meant = {
        "PENUMBRA_LIMITS__MAX_PIXEL": ["PENUMBRA_LIMITS__MAX_PIXELS"],
        "PENUMBRA_WORKER": ["PENUMBRA_WORKERS"],
        "PENUMBRA_XYZ": [],
        "penumbra_prot": ["PENUMBRA_PORT"],
    }
    for name in meant:
        monkeypatch.setenv(name, "s3cret")
    for name in ("PENUMBRA_LIMITS__MAX_LIGHTS", "penumbra_workers", "PENUMBRA_SERVER", "PENUMBRA_KEY"):
        monkeypatch.setenv(name, "2")
    outcome = here("doctor", "--json")
    checks = [check for check in outcome.document["checks"] if check["name"] == "variable"]
    assert {check["found"]: re.findall(r"PENUMBRA_\w+", check["advice"]) for check in checks} == meant
    assert "s3cret" not in outcome.out + outcome.err


@pytest.mark.parametrize(
    ("name", "value"),
    [("PORT", "many"), ("DATA", "file/data"), ("STORE", "s3://"), ("STORE", "s3://pictures/here")],
)
def test_unusable_setting_is_a_failure(
    here: Penumbra, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, value: str
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    for key in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(key, "s3cret")
    monkeypatch.setenv(f"PENUMBRA_{name}", value)
    outcome = here("doctor", "--json")
    assert outcome.code == ExitCode.SERVER
    (failed,) = (check for check in outcome.document["checks"] if check["level"] == "fail")
    assert f"PENUMBRA_{name}" in failed["found"] + failed["advice"]
    assert "s3cret" not in outcome.out


@pytest.mark.parametrize(
    ("url", "place", "form"),
    [
        ("postgresql://me:s3cret@127.0.0.1:9/x", "variable", ()),
        ("postgresql://me@127.0.0.1:9/x?password=s3cret&sslpassword=s3cret", "file", ("--json",)),
        ("postgresql://me:s3cret@127.0.0.1:port/x", "variable", ("--json",)),
        ("postgresql://me:s3cret@127.0.0.1:9/x?no_such_option=1", "file", ()),
        ("mysql://me:s3cret@127.0.0.1/x", "file", ("--json",)),
    ],
)
def test_password_is_never_shown(
    here: Penumbra,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    url: str,
    place: str,
    form: tuple[str, ...],
) -> None:
    (tmp_path / "p.toml").write_text(f'database = "{url}"\n')
    name, value = ("PENUMBRA_CONFIG", "p.toml") if place == "file" else ("PENUMBRA_DATABASE", url)
    monkeypatch.setenv(name, value)
    outcome = here("doctor", *form)
    assert outcome.code == ExitCode.SERVER
    assert "s3cret" not in outcome.out + outcome.err
    assert ("p.toml" if place == "file" else name) in outcome.out


def test_traces_are_sent_to_a_host_without_its_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    variable = "OTEL_EXPORTER_OTLP_ENDPOINT"
    monkeypatch.delenv(variable, raising=False)
    assert "not sent" in service_checks()["traces"].found
    monkeypatch.setenv(variable, "https://me:s3cret@collector:4318/s3cret?key=s3cret")
    assert service_checks()["traces"].found == f"sent to https://collector:4318 (from {variable})"
    monkeypatch.setenv("OTEL_SDK_DISABLED", "true")
    assert "not sent" in service_checks()["traces"].found


def test_workers_and_users_of_a_running_service(here: Penumbra, server: RunningServer) -> None:
    found = here("doctor", "--server", server.url, "--json").document
    assert [worker["name"] for worker in found["workers"]] == ["1", "2"]
    assert all(user["cpu_seconds"] >= 0 for user in found["users"])
    lines = here("doctor", "--server", server.url).out.splitlines()
    assert len(lines) == len(found["workers"]) + len(found["users"])
    assert lines[0].startswith(f"1\t{found['workers'][0]['pid']}\t")


def test_numerics_are_right_here(here: Penumbra) -> None:
    *lines, _ = here("doctor", "--numerics").out.splitlines()
    assert len(lines) >= 20
    assert {line.split(maxsplit=1)[0] for line in lines} == {"ok"}


def assert_wrong(outcome: Outcome, *names: str) -> None:
    assert outcome.code == ExitCode.BELOW_THRESHOLD, outcome.err
    wrong = {case["name"]: case["cure"] for case in outcome.document["cases"] if not case["right"]}
    assert wrong.keys() >= set(names)
    assert all(wrong.values())


def test_numerics_report_wrong_answers(here: Penumbra, monkeypatch: pytest.MonkeyPatch) -> None:
    def unclamped(c: np.ndarray, n: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):
            return np.sqrt((1 - n) * (1 + n) + (n * c) ** 2)

    def broken(values: np.ndarray) -> float:
        raise ZeroDivisionError

    monkeypatch.setattr(optics, "transmitted_cosine", unclamped)
    monkeypatch.setattr(self_test, "halving_sum", broken)
    assert_wrong(here("doctor", "--numerics", "--json"), "total reflection", "a million samples")


def test_numerics_report_another_rounding(tmp_path: Path) -> None:
    program = (
        "import ctypes, numpy, platform, accuracy.self_test; numpy.float64(1);"
        "upwards = 0x400000 if platform.machine() in ('aarch64', 'arm64') else 0x800;"
        "assert ctypes.CDLL(None).fesetround(upwards) == 0;"
        "from service.cli.main import main; main(['doctor', '--numerics', '--json'])"
    )
    outcome = ended(tmp_path, program=[sys.executable, "-W", "ignore", "-c", program])
    assert_wrong(outcome, *(f"float{bits} rounds to nearest, ties to even" for bits in (64, 32)))
