"""All seeded families of rays, each hard in one way."""

from collections.abc import Callable, Iterator

from renderer.hard_cases.draws import Case
from renderer.hard_cases.flat_families import FLAT
from renderer.hard_cases.round_families import ROUND

FAMILIES: dict[str, Callable[[], Iterator[Case]]] = {**FLAT, **ROUND}
