from __future__ import annotations

from pathlib import Path

import pytest

from service.cli.errors import CommandError
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
def test_option_before_variable_before_file(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("PORT", "WORKERS", "LIMITS__MAX_PIXELS"):
        monkeypatch.setenv(f"PENUMBRA_{name}", "2")
    settings = read_settings({"workers": 3})
    assert (settings.host, settings.port, settings.workers) == ("::1", 2, 3)
    assert (settings.limits.max_pixels, settings.limits.max_lights) == (2, 1)
    assert settings.max_quotes == Settings.model_fields["max_quotes"].default


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("wokers = 2", "There is no such setting"),
        ("workers = 0", "workers in"),
        ('[limits]\nmax_pixels = "many"', "limits.max_pixels in"),
        ("workers =", "is not TOML"),
    ],
)
def test_invalid_file_is_named(file: Path, content: str, said: str) -> None:
    file.write_text(content)
    with pytest.raises(CommandError) as caught:
        read_settings({})
    assert said in str(caught.value)
    assert file.name in str(caught.value)


def test_missing_file_is_named(file: Path) -> None:
    file.unlink()
    with pytest.raises(CommandError, match="cannot be read"):
        read_settings({})


@pytest.mark.slow
def test_doctor_shows_the_source_of_each_setting(penumbra: Penumbra, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(
        'database = "postgresql://me:secret@localhost/x"\n[limits]\nmax_lights = 7\n'
    )
    document = penumbra("doctor", "--config", "p.toml", "--json").document
    settings = {setting["name"]: (setting["value"], setting["source"]) for setting in document["settings"]}
    assert settings["limits.max_lights"] == ("7", "p.toml")
    assert settings["port"] == ("8000", "default")
    assert settings["database"] == ("postgresql://me:***@localhost/x", "p.toml")
    found = set(Settings.model_fields) - {"limits"}
    assert found == {name for name in settings if "." not in name}


@pytest.mark.parametrize(
    "store", ["gs://bucket", "s3://", "s3://ab", "s3://Bucket", "bucket", "s3://bucket/a b"]
)
def test_store_that_is_no_bucket(store: str) -> None:
    with pytest.raises(CommandError) as caught:
        read_settings({"store": store})
    assert "s3://BUCKET/PREFIX" in str(caught.value)


@pytest.mark.parametrize("store", ["s3://abc", "s3://my-bucket.x/renders/2026", "s3://bucket/"])
def test_bucket_with_prefix(store: str) -> None:
    assert read_settings({"store": store}).place == store
