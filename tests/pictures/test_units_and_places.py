"""Whole pictures: in other units, elsewhere, turned, and in both precisions."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import renderer
from tests.documents import Json
from tests.numerics.tracing import QUALITIES
from tests.pictures.parts import DOUBLE, SINGLE, plan_of
from tests.pictures.placed_scenes import FILES, QUARTER, SCENES, on_edges, placed, turn

CODE = 1 / 255
EVERY = pytest.mark.parametrize("name", SCENES)


def drawn(document: Json, quality: Any = None, **options: Any) -> Any:
    return renderer.render(plan_of(document, quality, files=FILES), **options).image


@cache
def edges_of(name: str) -> Any:
    return on_edges(plan_of(SCENES[name](), files=FILES))


@cache
def image_at_home(name: str, quality: Any) -> Any:
    return drawn(SCENES[name](), quality)


def check(image: Any, expected: Any, edges: Any, share: float) -> None:
    """Pixels look the same off all edges, and on them but for a share of the picture."""
    changed = ~(np.abs(image - expected).max(axis=2) <= CODE)
    assert not (changed & ~edges).any()
    assert changed.sum() <= share * edges.size


@EVERY
@pytest.mark.parametrize("quality", QUALITIES, ids=["single", "double"])
@pytest.mark.parametrize("power", [-300, 40])
def test_unit_of_a_power_of_two_changes_no_byte(power: int, quality: Any, name: str) -> None:
    assert (
        drawn(placed(SCENES[name](), 2.0**power), quality).tobytes() == image_at_home(name, quality).tobytes()
    )


CHANGES: dict[str, tuple[Callable[[Json], Json], float]] = {
    "a millionth": (lambda document: placed(document, 1e-6), 0.001),
    "a million away": (lambda document: placed(document, offset=1e6), 0.001),
    "turned by 37 degrees": (lambda document: placed(document, turned=turn(37)), 1.0),
}


@EVERY
@pytest.mark.parametrize("change", CHANGES)
def test_unit_place_and_direction_change_edges_alone(change: str, name: str) -> None:
    altered, share = CHANGES[change]
    check(drawn(altered(SCENES[name]()), SINGLE), image_at_home(name, SINGLE), edges_of(name), share)


@pytest.mark.parametrize(("number", "name"), list(enumerate(SCENES)), ids=list(SCENES))
def test_quarter_turn_changes_no_byte_in_double_precision(number: int, name: str) -> None:
    other = placed(SCENES[name](), turned=np.roll(QUARTER, number % 3, axis=(0, 1)))
    assert (drawn(other, DOUBLE) == image_at_home(name, DOUBLE)).all()
    assert np.abs(drawn(other, SINGLE) - image_at_home(name, SINGLE)).max() <= 2.0**-20


@EVERY
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_precision_changes_edges_alone(offset: float, name: str) -> None:
    document = placed(SCENES[name](), offset=offset)
    check(drawn(document, SINGLE), drawn(document, DOUBLE), on_edges(plan_of(document, files=FILES)), 0.005)
