"""An audit that could not ask is no pass, and says so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import audit

CLEAN = {"name": "Some.Package", "version": "1", "vulns": []}
BAD = {"name": "bad", "version": "1", "vulns": [{"id": "PYSEC-1"}, {"id": "PYSEC-2"}]}
SKIPPED = {"name": "gone", "skip_reason": "Dependency not found on PyPI and could not be audited"}


def ended(
    found: audit.Audit, monkeypatch: pytest.MonkeyPatch, folder: Path, *options: str
) -> tuple[int, dict[str, object]]:
    monkeypatch.chdir(folder)
    monkeypatch.setattr("sys.argv", ["audit", *options])
    monkeypatch.setattr(audit, "audit", lambda _constraints: found)
    code = audit.main()
    return code, json.loads((folder / "out" / "audit.json").read_text())


def test_packages_without_a_report_are_unknown() -> None:
    found = audit.read([CLEAN, BAD, SKIPPED], ["some-package", "bad", "gone", "forgotten"])
    assert found.looked_up == ("some-package", "bad")
    assert found.unknown == ("gone", "forgotten")
    assert found.advisories == {"bad": ["PYSEC-1", "PYSEC-2"]}


@pytest.mark.parametrize(("options", "code"), [((), 0), (("--strict",), 1)])
def test_where_no_server_answers_it_says_so_loudly(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    code: int,
) -> None:
    ended_with, report = ended(audit.read([SKIPPED], ["gone"]), monkeypatch, tmp_path, *options)
    assert ended_with == code
    assert report["complete"] is False
    assert "NOT AUDITED: nothing is known of 1 of 1 packages (gone)" in capsys.readouterr().err


def test_where_a_server_answers_a_package_that_it_does_not_know_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ended(audit.read([CLEAN, SKIPPED], ["some-package", "gone"]), monkeypatch, tmp_path)[0] == 1
    assert "(gone).\nThese versions are not known there: correct constraints.txt." in capsys.readouterr().err


def test_an_advisory_fails_the_check_unless_it_was_accepted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = audit.read([BAD], ["bad"])
    assert ended(found, monkeypatch, tmp_path)[0] == 1
    assert "bad: PYSEC-1, PYSEC-2" in capsys.readouterr().err
    monkeypatch.setattr(audit, "ACCEPTED", {"PYSEC-1": "it concerns Windows alone", "PYSEC-2": "the same"})
    assert ended(found, monkeypatch, tmp_path)[0] == 0
