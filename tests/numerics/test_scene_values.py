"""Values, units, places and tiles: what the counts of the hard cases do not say of them."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from accuracy.hard_cases.harness import DOUBLE
from accuracy.hard_cases.scene_values.pictures import CODE, wrong_pixels
from accuracy.hard_cases.scene_values.scenes import SCENES, image_of, on_edges, placed, plan_of, turn
from accuracy.hard_cases.scene_values.values import everything, numbers_in
from schemas.base import Closed
from schemas.reading import read_scene

EVERY = pytest.mark.parametrize("name", SCENES)


def objects(node: Any) -> Iterator[Closed]:
    """All objects of a scene that was read."""
    if isinstance(node, Closed):
        yield node
    values = (value for _, value in node) if isinstance(node, Closed) else node
    if isinstance(node, dict):
        values = node.values()
    if isinstance(node, Closed | dict | tuple):
        for value in values:
            yield from objects(value)


def test_the_scene_with_everything_writes_every_number_itself() -> None:
    """No field of a number, or of several, is left to its default."""
    for part in objects(read_scene(everything())[0]):
        defaults = json.loads(part.model_dump_json(exclude=part.model_fields_set))
        assert not list(numbers_in({k: v for k, v in defaults.items() if not isinstance(v, bool)}))


@EVERY
def test_places_rounded_to_a_millionth_change_edges_alone(name: str) -> None:
    """Moved by 2**32, places are rounded to 2**-20: now pixels do change, and each of them is an edge."""
    document = SCENES[name]()
    moved = image_of(placed(document, offset=2.0**32), DOUBLE)
    assert wrong_pixels(moved, image_of(document, DOUBLE), on_edges(plan_of(document)), 0.005) == 0


def test_an_edge_is_where_a_turn_by_a_tenth_of_a_degree_shows() -> None:
    """The measure sees what it is for: turned without its camera, a scene changes at its edges."""
    document = SCENES["ball on a floor"]()
    turned = {**placed(document, turned=turn(0.1)), "camera": document["camera"]}
    changed = np.abs(image_of(turned) - image_of(document)).max(axis=2) > CODE
    edges = on_edges(plan_of(document))
    assert changed.any()
    assert not (changed & ~edges).any()
    assert edges.mean() < 0.2


@EVERY
def test_most_of_a_picture_is_no_edge(name: str) -> None:
    assert on_edges(plan_of(SCENES[name]())).mean() < 0.5


@EVERY
@pytest.mark.slow
def test_no_pixel_depends_on_the_number_of_workers(name: str) -> None:
    document = SCENES[name]()
    alone = image_of(document)
    assert image_of(document, workers=2, tile_size=16).tobytes() == alone.tobytes()
