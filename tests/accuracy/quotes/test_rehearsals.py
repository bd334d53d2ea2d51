"""Cost of target quality, predicted from the first passes of the picture."""

from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.rehearsals import rehearse
from accuracy.quotes.settings import target
from renderer.compiling import compile_scene
from renderer.rendering import render
from renderer.scenes import LoadedScene


def test_picture_that_fits_the_time_is_known(ball_scene: LoadedScene) -> None:
    plan = compile_scene(ball_scene, target(2 / 255, "single"))
    known = rehearse(plan, Deadline.after(3600.0))
    assert known.reached is not None
    error = render(plan).report["error"]
    assert known.reached.document().items() <= error.items()
    assert 0 < known.cpu_seconds.low < known.cpu_seconds.estimate < known.cpu_seconds.high


def test_guess_is_wider_the_earlier_the_time_is_over(ball_scene: LoadedScene) -> None:
    plan = compile_scene(ball_scene, target(0.5 / 255, "single"))
    known, guess = (rehearse(plan, Deadline.after(seconds)) for seconds in (3600.0, 0.0))
    assert guess.reached is None
    widths = [each.cpu_seconds.high / each.cpu_seconds.low for each in (known, guess)]
    assert widths[0] < widths[1]
