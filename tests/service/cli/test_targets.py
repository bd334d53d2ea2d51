from __future__ import annotations

from pathlib import Path

import pytest

from service.cli.errors import CommandError
from service.cli.targets import ImageTarget, write_whole


def test_failed_write_leaves_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    target.mkdir()
    with pytest.raises(CommandError, match=r"a\.png cannot be written"):
        write_whole(target, b"content")
    assert list(tmp_path.iterdir()) == [target]


def test_older_file_is_replaced(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    target.write_bytes(b"a long old content")
    write_whole(target, b"new")
    assert target.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [target]


def test_mode_of_a_new_file(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.touch()
    write_whole(tmp_path / "a.png", b"")
    assert (tmp_path / "a.png").stat().st_mode == plain.stat().st_mode


def test_link_stays_a_link(tmp_path: Path) -> None:
    target, link = tmp_path / "there" / "a.png", tmp_path / "link.png"
    target.parent.mkdir()
    link.symlink_to(target)
    write_whole(link, b"content")
    assert link.is_symlink()
    assert target.read_bytes() == b"content"


def test_longest_name(tmp_path: Path) -> None:
    target = tmp_path / ("x" * 251 + ".png")
    write_whole(target, b"content")
    assert target.read_bytes() == b"content"


@pytest.mark.parametrize(
    ("text", "suffix", "on_stdout"),
    [
        ("-", ".png", True),
        ("-.npy", ".npy", True),
        ("-.exr", ".exr", True),
        ("-.NPY", ".npy", True),
        ("./-.npy", ".npy", False),
        ("a.PNG", ".png", False),
    ],
)
def test_dash_is_stdout(text: str, suffix: str, on_stdout: bool) -> None:
    target = ImageTarget.named(text)
    assert (target.suffix, target.on_stdout) == (suffix, on_stdout)
