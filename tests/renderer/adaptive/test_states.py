"""The states of a picture of target quality: in their order, for both kinds of pictures."""

import renderer
from accuracy.hard_cases.documents import camera
from renderer.adaptive import Estimate, render_samples
from renderer.adaptive.guides import surroundings
from renderer.adaptive.requests import TileRequest
from renderer.adaptive.states import State
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from tests.pictures import pictures

WHOLE = Tile(0, 0, 0, 24, 18)


def states(lens_radius: float) -> list[State]:
    """The states of a picture from its first pass to its end, each once in a row."""
    view = camera(width=24, height=18, lens_radius=lens_radius, focus_distance=5)
    target = TargetQuality(mode="target", error=4 / 255)
    plan = renderer.compile_scene(pictures.of_room(camera=view), target)
    estimate = Estimate.begin(plan)
    found = [estimate.state]
    goes_on = True
    while goes_on:
        around = surroundings(WHOLE, estimate.pilots, estimate.labels, estimate.colors)
        estimate.take(WHOLE, render_samples(plan, TileRequest(WHOLE, estimate.requested, around)))
        goes_on = estimate.advance()
        if estimate.state is not found[-1]:
            found.append(estimate.state)
    return found


def test_a_pinhole_picture_goes_from_its_preview_to_borders_and_probes() -> None:
    found = states(0)
    assert found[:3] == [State.PREVIEW, State.BORDERS, State.PROBES]
    assert found[-1] is State.DONE


def test_a_picture_through_a_lens_goes_from_its_lattice_to_probes() -> None:
    found = states(0.1)
    assert found[:2] == [State.LATTICE, State.PROBES]
    assert found[-1] is State.DONE
