"""Layers that a request may add to the picture."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Literal, get_args

from pydantic import AfterValidator

from schemas.reading.translation import nearest

LayerName = Literal[
    "depth", "position", "normal", "shading_normal", "albedo", "uv", "shape", "primitive", "samples", "error"
]
LAYER_NAMES: tuple[LayerName, ...] = get_args(LayerName)
"""All of them, in the order in which they are listed and stored."""


def _in_order(names: tuple[LayerName, ...]) -> tuple[LayerName, ...]:
    asked = set(names)
    return tuple(name for name in LAYER_NAMES if name in asked)


LayerNames = Annotated[tuple[LayerName, ...], AfterValidator(_in_order)]
"""Requested layers; each counts once, and their order is always the same."""


def checked_layers(names: Iterable[str]) -> tuple[LayerName, ...]:
    """Give the layers of these names in their order, each once.

    Raises
    ------
    TypeError
        The names are a single text.
    ValueError
        Names the unknown layer, and suggests a known one.

    Examples
    --------
    >>> checked_layers(["uv", "depth", "uv"])
    ('depth', 'uv')
    >>> checked_layers(["dept"])
    Traceback (most recent call last):
    ValueError: There is no layer 'dept'. Did you mean 'depth'?
    """
    if isinstance(names, str):
        # Its letters would be read as names.
        raise TypeError(f"Several layers may be asked for: write [{names!r}].")
    asked = list(names)
    for name in asked:
        if name not in LAYER_NAMES:
            meant = nearest(name, LAYER_NAMES)
            advice = f"Did you mean '{meant}'?" if meant else f"Layers are {', '.join(LAYER_NAMES)}."
            raise ValueError(f"There is no layer {name!r}. {advice}")
    return tuple(name for name in LAYER_NAMES if name in asked)
