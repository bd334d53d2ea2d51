"""Settings of a service, and its keys, which are made where it has its database."""

from pathlib import Path

import pytest

from service.cli.errors import CommandError, ExitCode
from service.cli.serve import read_settings
from service.settings import Settings
from tests.service.cli.conftest import Penumbra


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A settings file that is named by the environment."""
    path = tmp_path / "penumbra.toml"
    path.write_text('host = "::1"\nport = 1\nworkers = 1\n\n[limits]\nmax_pixels = 1\nmax_lights = 1\n')
    monkeypatch.setenv("PENUMBRA_CONFIG", str(path))
    return path


@pytest.mark.usefixtures("file")
def test_option_before_variable_before_file(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("PORT", "WORKERS", "LIMITS__MAX_PIXELS"):
        monkeypatch.setenv(f"PENUMBRA_{name}", "2")
    settings = read_settings({"workers": 3})
    assert (settings.host, settings.port, settings.workers) == ("::1", 2, 3)
    assert (settings.limits.max_pixels, settings.limits.max_lights) == (2, 1)
    assert settings.max_events == Settings.model_fields["max_events"].default


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("wokers = 2", "There is no such setting"),
        ('[limits]\nmax_pixels = "many"', "limits.max_pixels in"),
        ("workers =", "is not TOML"),
        (None, "cannot be read"),
    ],
)
def test_unusable_file_is_named(file: Path, content: str | None, said: str) -> None:
    if content is None:
        file.unlink()
    else:
        file.write_text(content)
    with pytest.raises(CommandError, match=said) as caught:
        read_settings({})
    assert file.name in str(caught.value)


@pytest.mark.parametrize("store", ["gs://bucket", "s3://ab", "s3://bucket/a b"])
def test_store_that_is_no_bucket(store: str) -> None:
    with pytest.raises(CommandError, match="s3://BUCKET/PREFIX"):
        read_settings({"store": store})


def test_bucket_with_prefix() -> None:
    store = "s3://my-bucket.x/renders/2026"
    assert read_settings({"store": store}).place == store


def test_new_key_is_alone_on_stdout(here: Penumbra) -> None:
    outcome = here("keys", "add", "ada", "--data", "lab")
    assert outcome.code == 0
    assert outcome.out.startswith("pnm_")
    assert outcome.out.count("\n") == 1
    assert outcome.out.strip() not in outcome.err


@pytest.mark.parametrize("words", [["ls"], ["revoke", "0123"]], ids=lambda words: words[0])
def test_keys_of_a_misspelt_folder(here: Penumbra, tmp_path: Path, words: list[str]) -> None:
    outcome = here("keys", *words, "--data", "typo")
    assert outcome.code == ExitCode.USAGE
    assert "There is no database of a service in typo." in outcome.err
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
def test_keys_of_an_unusable_database(here: Penumbra, option: str, value: str, reason: str) -> None:
    outcome = here("keys", "add", "ada", option, value)
    assert (outcome.code, outcome.out) == (ExitCode.USAGE, "")
    assert reason in outcome.err
    assert "Traceback" not in outcome.err
