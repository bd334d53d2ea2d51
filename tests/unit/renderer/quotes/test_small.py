"""Seconds of target quality from pictures of reduced size."""

from __future__ import annotations

import pytest

from renderer.quotes.deadlines import Deadline
from renderer.quotes.small import POWER, Growing, Small
from renderer.scenes import LoadedScene

HOUR = Deadline.after(3600.0)


@pytest.fixture
def growing(ball_scene: LoadedScene) -> Growing:
    return Growing(ball_scene, 4 / 255, "single", 1e-6)


def test_a_picture_that_is_small_enough_is_rendered_as_a_whole(growing: Growing) -> None:
    growing.run(HOUR, HOUR)
    assert growing.whole
    assert [picture.pixels for picture in growing.pictures] == [48 * 40]
    known = growing.cpu_seconds()
    assert known is not None
    assert known.estimate == growing.pictures[0].cpu_seconds
    assert known.high < 1.2 * known.estimate


def test_pictures_grow_to_the_whole_where_there_is_time(ball_scene: LoadedScene) -> None:
    camera = ball_scene.document.camera.model_copy(update={"width": 160, "height": 128})
    scene = LoadedScene(ball_scene.document.model_copy(update={"camera": camera}), ball_scene.assets)
    growing = Growing(scene, 4 / 255, "single", 1e-6)
    growing.run(HOUR, HOUR)
    assert [picture.pixels for picture in growing.pictures] == [64 * 52, 160 * 128]


def test_no_picture_begins_without_time_for_it(growing: Growing) -> None:
    growing.run(Deadline.after(-1.0), HOUR)
    assert growing.pictures == []
    assert growing.cpu_seconds() is None


def test_a_picture_is_given_up_when_the_deadline_comes(growing: Growing) -> None:
    growing.run(HOUR, Deadline.after(-1.0))
    assert growing.pictures == []


def test_the_last_picture_tells_what_the_whole_one_takes(growing: Growing) -> None:
    growing.pictures = [Small(100, 9.0, 9.0), Small(480, 2.0, 1.0)]
    known = growing.cpu_seconds()
    assert known is not None
    assert known.estimate == pytest.approx(2.0 * 4**POWER)


def test_smaller_pictures_tell_less(growing: Growing) -> None:
    widths = []
    for pixels in (1920, 480, 120):
        growing.pictures = [Small(pixels, 1.0, 1.0)]
        known = growing.cpu_seconds()
        assert known is not None
        widths.append(known.high / known.low)
    assert widths == sorted(widths)


def test_the_first_picture_is_smaller_where_time_is_short(ball_scene: LoadedScene) -> None:
    # A ray of a second: nothing of 64 or 32 pixels would be finished.
    camera = ball_scene.document.camera.model_copy(update={"width": 160, "height": 128})
    scene = LoadedScene(ball_scene.document.model_copy(update={"camera": camera}), ball_scene.assets)
    growing = Growing(scene, 4 / 255, "single", 1.0)
    growing.begin(HOUR)
    assert [picture.pixels for picture in growing.pictures] == [16 * 13]
