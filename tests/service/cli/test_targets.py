from __future__ import annotations

from pathlib import Path

import pytest

from service.cli.errors import CommandError
from service.cli.targets import ImageTarget, check_target, write_whole


def test_a_file_that_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    target.mkdir()
    with pytest.raises(CommandError, match=r"a\.png cannot be written"):
        write_whole(target, b"content")
    assert list(tmp_path.iterdir()) == [target]


def test_an_older_file_is_replaced_and_keeps_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    target.write_bytes(b"a long old content")
    write_whole(target, b"new")
    assert target.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [target]


def test_a_new_file_has_the_rights_that_any_new_file_has(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.touch()
    write_whole(tmp_path / "a.png", b"")
    assert (tmp_path / "a.png").stat().st_mode == plain.stat().st_mode


def test_checking_a_target_leaves_its_folder_as_it_was(tmp_path: Path) -> None:
    assert check_target(tmp_path / "A.PNG", (".png",)) == tmp_path / "A.PNG"
    assert list(tmp_path.iterdir()) == []


def test_a_link_leads_to_the_new_file_and_stays_a_link(tmp_path: Path) -> None:
    target, link = tmp_path / "there" / "a.png", tmp_path / "link.png"
    target.parent.mkdir()
    link.symlink_to(target)
    write_whole(link, b"content")
    assert link.is_symlink()
    assert target.read_bytes() == b"content"


def test_a_name_may_be_as_long_as_the_system_allows(tmp_path: Path) -> None:
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
def test_a_dash_is_stdout_and_its_ending_chooses_the_format(text: str, suffix: str, on_stdout: bool) -> None:
    target = ImageTarget.named(text)
    assert (target.suffix, target.on_stdout) == (suffix, on_stdout)
