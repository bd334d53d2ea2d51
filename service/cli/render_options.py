"""Options of every command that renders: worker processes, and other samples than those of the scene."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import wraps
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

import typer

from service.cli.errors import CommandError

if TYPE_CHECKING:
    from schemas.quality import FixedQuality, TargetQuality

# Written down twice so that help need not load the settings; a test compares the two.
MOST_WORKERS = 1024

WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, max=MOST_WORKERS, help="Worker processes; by default one for each processor."),
]

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
TargetErrorOption = Annotated[
    float | None,
    typer.Option(
        "--target-error",
        help="Sample where it is needed until the picture's root mean square error is at most this; "
        "one code value of 255 is 0.0039.",
        rich_help_panel=PANEL,
    ),
]
ConfidenceOption = Annotated[
    float | None,
    typer.Option(
        "--confidence",
        help="With --target-error: share of such pictures that are to keep it, 0.5 to below 1; usually 0.95.",
        rich_help_panel=PANEL,
    ),
]
TimeLimitOption = Annotated[
    float | None,
    typer.Option(
        "--time-limit",
        help="With --target-error: seconds after which the picture is taken as it is.",
        rich_help_panel=PANEL,
    ),
]


@dataclass(frozen=True, slots=True)
class SampleOptions:
    """The options that ask for exactly so many samples."""

    samples: SamplesOption = None
    pattern: PatternOption = None
    light_samples: LightSamplesOption = None
    light_pattern: LightPatternOption = None
    precision: PrecisionOption = None

    def requested(self, scene: Mapping[str, Any]) -> FixedQuality | TargetQuality | None:
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
        return _fixed(scene, self.counts(), self.precision)

    def counts(self) -> dict[str, Any]:
        """The options that choose samples, by name."""
        return {
            "--samples": self.samples,
            "--pattern": self.pattern,
            "--light-samples": self.light_samples,
            "--light-pattern": self.light_pattern,
        }


@dataclass(frozen=True, slots=True)
class QualityOptions(SampleOptions):
    """The options that ask for samples, or for a target error."""

    target_error: TargetErrorOption = None
    confidence: ConfidenceOption = None
    time_limit: TimeLimitOption = None

    def requested(self, scene: Mapping[str, Any]) -> FixedQuality | TargetQuality | None:
        """As in `SampleOptions`; a target error decides about samples by itself."""
        if self.target_error is not None:
            _check_alone(self.counts())
            limits = {"confidence": self.confidence, "time_limit": self.time_limit}
            return _target({"error": self.target_error, **limits, "precision": self.precision})
        if self.confidence is not None:
            raise CommandError("--confidence is that of a target error. Give --target-error too.")
        if self.time_limit is not None:
            raise CommandError("--time-limit ends a picture of target quality. Give --target-error too.")
        return _fixed(scene, self.counts(), self.precision)


def spread_quality(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command an option for each member of its parameter ``quality``, in its place.

    Typer makes options of the parameters of a function alone.
    """
    signature = inspect.signature(command, eval_str=True)
    kind = signature.parameters["quality"].annotation
    hints = get_type_hints(kind, include_extras=True)
    options = [
        inspect.Parameter(
            field.name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=hints[field.name]
        )
        for field in fields(kind)
    ]

    @wraps(command)
    def gathered(**given: Any) -> None:
        members = {option.name: given.pop(option.name) for option in options}
        command(quality=kind(**members), **given)

    parameters: list[inspect.Parameter] = []
    for parameter in signature.parameters.values():
        parameters += options if parameter.name == "quality" else [parameter]
    gathered.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return gathered


def _check_alone(fixed: Mapping[str, object]) -> None:
    given = [option for option, value in fixed.items() if value is not None]
    if given:
        message = "--target-error decides about samples by itself. Leave out " + " and ".join(given) + "."
        raise CommandError(message)


def _target(asked: Mapping[str, object]) -> TargetQuality:
    from pydantic import ValidationError

    from schemas.quality import TargetQuality

    members = {name: value for name, value in asked.items() if value is not None}
    try:
        return TargetQuality.model_validate({"mode": "target"} | members)
    except ValidationError as error:
        raise CommandError(" ".join(_option(item) for item in error.errors(include_url=False))) from error


def _fixed(
    scene: Mapping[str, Any], given: Mapping[str, Any], precision: Precision | None
) -> FixedQuality | None:
    from pydantic import ValidationError

    from schemas.quality import FixedQuality

    asked = {
        "antialiasing": _merged(scene, "antialiasing", given["--samples"], given["--pattern"]),
        "light": _merged(scene, "light", given["--light-samples"], given["--light-pattern"]),
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
    alone = {"error": "target-error", "time_limit": "time-limit"}
    return f"{names.get(part, '--')}{rest[0] if rest else alone.get(part, part)}: {item['msg'].rstrip('.')}."
