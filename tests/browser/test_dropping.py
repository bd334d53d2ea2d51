"""Files that are dropped: archives are opened, and no drop is without an answer."""

from __future__ import annotations

import io
import struct
import zipfile

import pytest
from playwright.sync_api import Page, Route, expect

from tests.browser.conftest import Open
from tests.browser.scenes import GALLERY, TIMEOUT, choose, drop, expect_written, opened, small
from tests.service.support import until

TILES = (GALLERY / "textures" / "tiles.png").read_bytes()


def archive(method: int, **files: bytes) -> bytes:
    """A ZIP of files in a folder, as a computer of Apple makes it; `__` in a name stands for the dot."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as packed:
        packed.writestr("task/", "")
        for name, content in files.items():
            packed.writestr(f"task/{name.replace('__', '.')}", content)
            packed.writestr(f"__MACOSX/task/._{name.replace('__', '.')}", b"attributes")
    return buffer.getvalue()


@pytest.mark.slow
@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED], ids=["stored", "deflated"])
@pytest.mark.parametrize("path", ["/", "/jobs"])
def test_archive_of_a_scene_and_its_files_is_opened(open_page: Open, path: str, method: int) -> None:
    page = open_page(path)
    drop(page, task__zip=archive(method, mine__json=small().encode(), tiles__png=TILES))
    expect(page.get_by_role("heading", level=1)).to_have_text("mine.json", timeout=TIMEOUT)
    expect_written(page, small())
    expect(page.locator(".files li")).to_have_count(1, timeout=TIMEOUT)
    expect(page.locator(".files li")).to_contain_text("here")
    opened(page)


@pytest.mark.slow
@pytest.mark.parametrize("held", ["gallery.json", "gallery/basic.json"])
def test_drop_before_the_first_scene_is_here_stays(open_page: Open, held: str) -> None:
    page = open_page("/jobs")
    waiting: list[Route] = []

    def hold(route: Route) -> None:
        waiting.append(route)

    page.route(f"**/{held}", hold)
    page.get_by_role("link", name="Start").click()
    until(lambda: page.evaluate("1") == len(waiting))
    drop(page, mine__json=small("basic").encode())
    expect(page.get_by_role("heading", level=1)).to_have_text("mine.json", timeout=TIMEOUT)
    waiting[0].continue_()
    opened(page)
    page.wait_for_timeout(500)
    expect_written(page, small("basic"))


@pytest.mark.slow
def test_damaged_archive_is_named(page: Page) -> None:
    whole = archive(zipfile.ZIP_DEFLATED, mine__json=small().encode())
    at = whole.index(b"mine.json") + len("mine.json")
    declared, lied = (struct.pack("<I", size) for size in (len(small()), 1))
    cases = {
        "no end": whole[:-30],
        "other bytes": whole[:at] + bytes(40) + whole[at + 40 :],
        "longer than declared": whole.replace(declared, lied),
        "empty": b"",
    }
    for name, content in cases.items():
        drop(page, task__zip=content)
        dialog = page.get_by_role("dialog")
        expect(dialog, name).to_contain_text("task.zip cannot be opened", timeout=TIMEOUT)
        dialog.get_by_role("button").click()


@pytest.mark.slow
def test_file_that_no_scene_names_is_answered(page: Page) -> None:
    opened(page)
    drop(page, shell__obj=b"v 0 0 0\n", wood__png=TILES, notes__txt=b"-")
    listed = page.locator(".files li")
    for name, answer in {
        "shell.obj": '{"type": "mesh", "asset": "shell.obj", "material": …}',
        "wood.png": '{"type": "image", "asset": "wood.png"}',
        "notes.txt": "Scenes use no files of this kind.",
    }.items():
        expect(listed.filter(has_text=name)).to_contain_text(answer, timeout=TIMEOUT)


@pytest.mark.slow
def test_line_breaks_of_another_system_are_no_edit(page: Page) -> None:
    opened(page)
    drop(page, mine__json=small("basic").replace("\n", "\r\n").encode())
    expect_written(page, small("basic"))
    choose(page, "Falloff")
    expect(page.get_by_role("heading", level=1)).to_have_text("Falloff", timeout=TIMEOUT)
