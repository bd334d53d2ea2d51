"""Keys of a service, made and listed where the service has its database."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.cli.errors import ExitCode
from tests.service.cli.conftest import Penumbra


def test_new_key_is_alone_on_stdout(here: Penumbra) -> None:
    outcome = here("keys", "add", "ada", "--data", "lab")
    assert outcome.code == 0
    assert outcome.out.startswith("pnm_")
    assert outcome.out.count("\n") == 1
    assert "of ada is in the data folder lab" in outcome.err
    assert outcome.out.strip() not in outcome.err


@pytest.mark.parametrize("words", [["ls"], ["revoke", "0123"]], ids=lambda words: words[0])
def test_misspelt_folder_is_not_created(here: Penumbra, tmp_path: Path, words: list[str]) -> None:
    outcome = here("keys", *words, "--data", "typo")
    assert outcome.code == ExitCode.USAGE
    assert "There is no database of a service in typo. Give its --data or --database." in outcome.err
    assert not (tmp_path / "typo").exists()


@pytest.mark.parametrize(
    ("option", "value", "reason"),
    [
        ("--data", "scene.json", "it is a file"),
        ("--database", "mysql://localhost/penumbra", "postgresql://user@host/name"),
        ("--database", "postgresql://127.0.0.1:1/penumbra", "Connection refused"),
    ],
)
@pytest.mark.usefixtures("scene_file")
def test_unusable_database_is_usage(here: Penumbra, option: str, value: str, reason: str) -> None:
    outcome = here("keys", "add", "ada", option, value)
    assert outcome.code == ExitCode.USAGE
    assert outcome.out == ""
    assert reason in outcome.err
    assert "bug" not in outcome.err
    assert "Traceback" not in outcome.err
