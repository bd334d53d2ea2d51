"""Options that ask for other samples than the scene does, the same for every command that renders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from service.cli.errors import CommandError

if TYPE_CHECKING:
    from schemas.quality import FixedQuality

Pattern = Literal["center", "uniform", "rotated", "random", "stratified", "sobol"]
LightPattern = Literal["uniform", "random", "stratified", "sobol"]
Precision = Literal["single", "double"]

PANEL = "Quality, in place of the scene's sampling"
SamplesOption = Annotated[
    int | None, typer.Option("--samples", min=1, help="Camera samples a pixel.", rich_help_panel=PANEL)
]
PatternOption = Annotated[
    Pattern | None, typer.Option("--pattern", help="Where they lie in the pixel.", rich_help_panel=PANEL)
]
LightSamplesOption = Annotated[
    int | None,
    typer.Option("--light-samples", min=1, help="Points on each rectangle light.", rich_help_panel=PANEL),
]
LightPatternOption = Annotated[
    LightPattern | None,
    typer.Option("--light-pattern", help="Where they lie on the light.", rich_help_panel=PANEL),
]
PrecisionOption = Annotated[
    Precision | None,
    typer.Option("--precision", help="Of the work on pairs of point and light.", rich_help_panel=PANEL),
]


def quality(
    scene: Mapping[str, Any],
    *,
    samples: int | None,
    pattern: Pattern | None,
    light_samples: int | None,
    light_pattern: LightPattern | None,
    precision: Precision | None,
) -> FixedQuality | None:
    """The quality that the options ask for, None where they ask for nothing.

    Parameters
    ----------
    scene
        The scene's document: of two options that belong together, the one not given is the scene's.

    Raises
    ------
    CommandError
        The options contradict each other.
    """
    from pydantic import ValidationError

    from schemas.quality import FixedQuality

    asked = {
        "antialiasing": _merged(scene, "antialiasing", samples, pattern),
        "light": _merged(scene, "light", light_samples, light_pattern),
        "precision": precision,
    }
    members = {name: value for name, value in asked.items() if value is not None}
    if not members:
        return None
    try:
        return FixedQuality.model_validate({"mode": "fixed"} | members)
    except ValidationError as error:
        raise CommandError(" ".join(_option(item) for item in error.errors(include_url=False))) from error


def _merged(
    scene: Mapping[str, Any], part: str, samples: int | None, pattern: str | None
) -> dict[str, Any] | None:
    if samples is None and pattern is None:
        return None
    sampling = scene.get("sampling")
    own = sampling.get(part) if isinstance(sampling, Mapping) else None
    given = {"samples": samples, "pattern": pattern}
    kept = dict(own) if isinstance(own, Mapping) else {}
    if pattern == "center":
        kept.pop("samples", None)
    return kept | {name: value for name, value in given.items() if value is not None}


def _option(item: Mapping[str, Any]) -> str:
    part, *rest = [str(step) for step in item["loc"]]
    names = {"antialiasing": "--", "light": "--light-"}
    return f"{names.get(part, '--')}{rest[0] if rest else part}: {item['msg'].rstrip('.')}."
