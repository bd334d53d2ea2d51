"""Options of commands that render: samples or a target error instead of the scene's sampling."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, get_type_hints

import typer

from service.cli.errors import CommandError
from service.cli.wording import plain

if TYPE_CHECKING:
    from schemas.quality import FixedQuality, TargetQuality

Pattern = Literal["center", "uniform", "rotated", "random", "stratified", "sobol"]
LightPattern = Literal["uniform", "random", "stratified", "sobol"]
Precision = Literal["single", "double"]
Checked = TypeVar("Checked", "FixedQuality", "TargetQuality")

PANEL = "Quality, in place of the scene's sampling"


def _option(text: str, **more: Any) -> Any:
    return typer.Option(help=text, rich_help_panel=PANEL, **more)


@dataclass(frozen=True, slots=True)
class SampleOptions:
    """The options for fixed numbers of samples."""

    samples: Annotated[int | None, _option("Camera samples per pixel.", min=1)] = None
    pattern: Annotated[Pattern | None, _option("How camera samples are placed in a pixel.")] = None
    light_samples: Annotated[int | None, _option("Points on each rectangle light.", min=1)] = None
    light_pattern: Annotated[LightPattern | None, _option("How points are placed on a light.")] = None
    precision: Annotated[
        Precision | None, _option("Precision of shadows and highlights: float32 or float64.")
    ] = None

    def requested(self, scene: Mapping[str, Any]) -> FixedQuality | TargetQuality | None:
        """The quality that the options choose; None without any.

        Parameters
        ----------
        scene
            The scene's document: of two options that belong together, the one not given is the scene's.

        Raises
        ------
        CommandError
            The options contradict each other.
        """
        from schemas.quality import FixedQuality

        members = {
            "antialiasing": _merged(scene, "antialiasing", self.samples, self.pattern),
            "light": _merged(scene, "light", self.light_samples, self.light_pattern),
            "precision": self.precision,
        }
        return _checked(FixedQuality, "fixed", members) if any(members.values()) else None

    def counts(self) -> dict[str, Any]:
        """Values of the options that choose samples, by name."""
        return {
            "--samples": self.samples,
            "--pattern": self.pattern,
            "--light-samples": self.light_samples,
            "--light-pattern": self.light_pattern,
        }


@dataclass(frozen=True, slots=True)
class QualityOptions(SampleOptions):
    """The options for samples, or for a target error."""

    target_error: Annotated[
        float | None,
        _option(
            "In place of all these: sample where needed until the root mean square error is at most this. "
            "One code value of 255 is 0.0039."
        ),
    ] = None
    confidence: Annotated[
        float | None,
        _option(
            "With --target-error: share of pictures that must reach it, 0.5 to below 1; 0.95 by default."
        ),
    ] = None
    time_limit: Annotated[
        float | None,
        _option("With --target-error: stop after this many seconds, with the error reached so far."),
    ] = None

    def requested(self, scene: Mapping[str, Any]) -> FixedQuality | TargetQuality | None:
        """As in `SampleOptions`; a target error chooses the samples."""
        if self.target_error is None:
            for option, value in (("--confidence", self.confidence), ("--time-limit", self.time_limit)):
                if value is not None:
                    raise CommandError(f"{option} is part of target quality. Give --target-error too.")
            return SampleOptions.requested(self, scene)
        given = [option for option, value in self.counts().items() if value is not None]
        if given:
            raise CommandError(f"--target-error chooses the samples. Leave out {' and '.join(given)}.")
        from schemas.quality import TargetQuality

        limits = {"confidence": self.confidence, "time_limit": self.time_limit}
        return _checked(
            TargetQuality, "target", {"error": self.target_error, **limits, "precision": self.precision}
        )


def flattened_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command an option for each member of its dataclass parameters, in their positions.

    Typer makes options only of the parameters of a function.
    """
    signature = inspect.signature(command, eval_str=True)
    kinds: dict[str, Any] = {
        name: parameter.annotation
        for name, parameter in signature.parameters.items()
        if is_dataclass(parameter.annotation)
    }
    options = {name: _parameters(kind) for name, kind in kinds.items()}

    @wraps(command)
    def gathered(**given: Any) -> None:
        groups = {
            name: kinds[name](**{option.name: given.pop(option.name) for option in members})
            for name, members in options.items()
        }
        command(**groups, **given)

    parameters: list[inspect.Parameter] = []
    for parameter in signature.parameters.values():
        parameters += options.get(parameter.name, [parameter])
    gathered.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return gathered


def _parameters(kind: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(kind, include_extras=True)
    return [
        inspect.Parameter(
            field.name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=hints[field.name]
        )
        for field in fields(kind)
    ]


def _checked(kind: type[Checked], mode: str, members: Mapping[str, object]) -> Checked:
    """A quality with the given members, those that are not None."""
    from pydantic import ValidationError

    given = {name: value for name, value in members.items() if value is not None}
    try:
        return kind.model_validate({"mode": mode} | given)
    except ValidationError as error:
        raise CommandError(" ".join(map(_problem, error.errors(include_url=False)))) from error


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


def _problem(item: Mapping[str, Any]) -> str:
    part, *rest = [str(step) for step in item["loc"]]
    names = {"antialiasing": "--", "light": "--light-"}
    alone = {"error": "target-error", "time_limit": "time-limit"}
    return f"{names.get(part, '--')}{rest[0] if rest else alone.get(part, part)}: {plain(item['msg'])}"
