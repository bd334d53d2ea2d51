"""Output targets: files, stdout, and the viewer tev."""

from pathlib import Path

import pytest

from service.cli.errors import CommandError
from service.cli.targets import ImageTarget, write_whole
from service.cli.tev import parsed


def test_failed_write_leaves_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    target.mkdir()
    with pytest.raises(CommandError, match=r"a\.png cannot be written"):
        write_whole(target, b"content")
    assert list(tmp_path.iterdir()) == [target]


def test_older_file_is_replaced_with_the_mode_of_a_new_one(tmp_path: Path) -> None:
    target, plain = tmp_path / ("x" * 251 + ".png"), tmp_path / "plain"
    target.write_bytes(b"a long old content")
    plain.touch()
    write_whole(target, b"new")
    assert target.read_bytes() == b"new"
    assert target.stat().st_mode == plain.stat().st_mode
    assert sorted(tmp_path.iterdir()) == [plain, target]


def test_link_stays_a_link(tmp_path: Path) -> None:
    target, link = tmp_path / "there" / "a.png", tmp_path / "link.png"
    target.parent.mkdir()
    link.symlink_to(target)
    write_whole(link, b"content")
    assert link.is_symlink()
    assert target.read_bytes() == b"content"


@pytest.mark.parametrize(
    ("text", "suffix", "on_stdout"),
    [("-", ".png", True), ("-.NPY", ".npy", True), ("./-.npy", ".npy", False), ("a.PNG", ".png", False)],
)
def test_dash_is_stdout(text: str, suffix: str, on_stdout: bool) -> None:
    target = ImageTarget.named(text)
    assert (target.suffix, target.on_stdout) == (suffix, on_stdout)


@pytest.mark.parametrize("address", ["studio:port", "studio:0", "studio:65536", ":14158", "a:b:c", ""])
def test_address_of_no_tev(address: str) -> None:
    with pytest.raises(CommandError, match="Write HOST:PORT"):
        parsed(address)
