"""``penumbra quote``: the predicted cost and error of a picture, before it is rendered."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import output, scene_files
from service.cli.options import JsonOption, SceneArgument, WorkersOption
from service.cli.quality_options import SampleOptions, flattened_options
from service.cli.size_options import SizeOptions
from service.cli.wording import counted

if TYPE_CHECKING:
    from rich.table import Table

    from schemas.api.plans import EffectShare, Offer, Predicted, Quote
    from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality

NOTHING = "nothing that was tried"
"""Shown instead of a quality if none reaches the target."""

CODE_VALUES = 255
"""Errors are shown in code values of an 8-bit picture."""


@flattened_options
def quote(
    *,
    scene: SceneArgument,
    target_error: Annotated[
        float | None,
        typer.Option(
            min=1e-6,
            max=1.0,
            help="A target root mean square error: find the quality that reaches it soonest. "
            "One code value of 255 is 0.0039.",
        ),
    ] = None,
    time: Annotated[
        float | None,
        typer.Option(
            min=1e-3, max=86400.0, help="A time limit in seconds: find the quality with the smallest error."
        ),
    ] = None,
    quality: SampleOptions,
    size: SizeOptions,
    workers: WorkersOption = None,
    as_json: JsonOption = False,
) -> None:
    """Predict time and error of a scene at several qualities.

    Parts of it are rendered, for at most 1.5 CPU seconds.
    """
    from accuracy.quotes import quote as quoted
    from renderer.processors import usable_processors

    file = scene_files.load(scene, size=size)
    requested = quality.requested(file.scene.document.model_dump())
    # Compilation errors are reported with the lines of the file.
    file.plan(requested)
    found = quoted(
        file.scene,
        requested,
        target_error=target_error,
        seconds=time,
        workers=workers or usable_processors(),
    )
    if output.on_terminal() and not as_json:
        _show(found, target_error, time)
    else:
        output.report(found, _plain(found, target_error, time), as_json=as_json)


def _plain(found: Quote, target_error: float | None, time: float | None) -> Iterator[str]:
    for offer in found.offers:
        yield _line("offer", offer)
    if found.asked is not None:
        yield _line("asked", found.asked)
    for name, requested, best in (
        ("for error", target_error, found.for_error),
        ("for time", time, found.for_seconds),
    ):
        if requested is not None:
            yield _line(name, best)
    for reason in unknown_errors(found):
        yield f"error unknown\t{reason}"
    for reason in rough_costs(found):
        yield f"rough cost\t{reason}"
    for effect in found.effects:
        pointers = " ".join(map(output.harmless, effect.pointers))
        yield f"effect\t{effect.effect}\t{effect.share:.0%}\t{effect.cpu_seconds:.3g}\t{pointers}"


def unknown_errors(found: Quote) -> list[str]:
    """Why errors are not known, each reason once."""
    return _reasons(found, "error_unknown")


def rough_costs(found: Quote) -> list[str]:
    """Why costs are rough guesses, each reason once."""
    return _reasons(found, "rough")


def _reasons(found: Quote, name: str) -> list[str]:
    offers = (*found.offers, found.asked, found.for_seconds)
    return list(dict.fromkeys(getattr(offer, name) for offer in offers if offer and getattr(offer, name)))


def _line(name: str, offer: Offer | None) -> str:
    if offer is None:
        return f"{name}\t{NOTHING}\t\t\t"
    numbers = map(_numbers, (offer.seconds, offer.cpu_seconds, offer.error))
    return "\t".join([name, describe(offer.quality), *numbers])


def _numbers(known: Predicted | None) -> str:
    return "" if known is None else f"{known.estimate:.3g} {known.low:.3g} {known.high:.3g}"


def describe(quality: FixedQuality | TargetQuality) -> str:
    """A quality, named like the options of ``penumbra render``."""
    if quality.mode == "target":
        limit = f", at most {quality.time_limit:g} s" if quality.time_limit else ""
        return f"error {quality.error:.2g}{limit}"
    camera, light = _samples(quality)
    return f"{camera.pattern} {camera.samples}, light {light.pattern} {light.samples}"


def _samples(quality: FixedQuality) -> tuple[Antialiasing, LightSampling]:
    # A quality that was offered names both.
    assert quality.antialiasing is not None
    assert quality.light is not None
    return quality.antialiasing, quality.light


def options(quality: FixedQuality | TargetQuality) -> str:
    """The options of ``penumbra render`` for a quality."""
    double = " --precision double" if quality.precision == "double" else ""
    from schemas.quality import CONFIDENCE

    if quality.mode == "target":
        limit = f" --time-limit {quality.time_limit:g}" if quality.time_limit else ""
        sure = "" if quality.confidence == CONFIDENCE else f" --confidence {quality.confidence:g}"
        return f"--target-error {quality.error:.2g}{sure}{limit}{double}"
    camera, light = _samples(quality)
    return (
        f"--samples {camera.samples} --pattern {camera.pattern} "
        f"--light-samples {light.samples} --light-pattern {light.pattern}{double}"
    )


def _show(found: Quote, target_error: float | None, time: float | None) -> None:
    if found.offers:
        seconds = f"Seconds on {counted(found.workers, 'worker')}. "
        output.show(offers(found), seconds + "The quality of the scene or of the options is bold.")
    for reason in unknown_errors(found):
        output.show(f"Error not known (?): {reason}")
    for reason in rough_costs(found):
        output.show(f"Seconds are a guess (~): {reason}")
    if target_error is not None:
        _advise(f"For an error of {target_error:.2g}", found.for_error)
    if time is not None:
        _advise(f"In {time:g} s", found.for_seconds)
    if found.effects:
        headings = ("Effect", "Share", "CPU seconds", "Asked for by")
        output.show(output.table(headings, map(_effect_cells, found.effects)))
    output.show(_pilot(found), style="dim")


def offers(found: Quote) -> Table:
    """A row for each offer, with the requested one in bold."""
    headings = ("Quality", "Seconds", "Error x 255")
    table = output.table(headings, (), numbers=headings[1:], no_wrap=True)
    before = None
    for offer in found.offers:
        ladder = _ladder(offer.quality)
        if before not in {None, ladder}:
            table.add_section()
        before = ladder
        table.add_row(*_cells(offer), style="bold" if offer == found.asked else None)
    return table


def _ladder(quality: FixedQuality | TargetQuality) -> object:
    if quality.mode == "target":
        return "target"
    return quality.antialiasing and quality.antialiasing.pattern, quality.light


def _cells(offer: Offer) -> Iterable[str]:
    seconds = ("~" if offer.rough else "") + _range(offer.seconds)
    return short(offer.quality), seconds, _range(offer.error, CODE_VALUES)


def short(quality: FixedQuality | TargetQuality) -> str:
    """A quality in at most 30 characters: camera by light samples, or an error in code values of 255."""
    if quality.mode == "target":
        return f"target {CODE_VALUES * quality.error:.2g}/{CODE_VALUES}"
    camera, light = _samples(quality)
    between = "x" if light.pattern == camera.pattern else f"x {light.pattern}"
    return f"{camera.pattern} {camera.samples} {between} {light.samples}"


def _range(known: Predicted | None, unit: float = 1.0) -> str:
    if known is None:
        return "?"
    estimate, low, high = (_short(unit * each) for each in (known.estimate, known.low, known.high))
    return f"{estimate} ({low}-{high})"


def _short(number: float) -> str:
    """Two digits, and all those before the point.

    >>> _short(0.00123), _short(1234.5), _short(0.0)
    ('0.0012', '1234', '0')
    """
    return f"{number:.2g}" if number < 100 else f"{number:.0f}"


def _advise(requested: str, offer: Offer | None) -> None:
    if offer is None:
        output.show(f"{requested}: {NOTHING}.")
        return
    error = "" if offer.error is None else f", error {_range(offer.error)}"
    output.show(f"{requested}: {options(offer.quality)}", style="bold")
    output.show(f"    {_range(offer.seconds)} s{error}")


def _effect_cells(effect: EffectShare) -> tuple[str, ...]:
    pointers = "\n".join(map(output.harmless, effect.pointers[:3]))
    return effect.effect, f"{100 * effect.share:.0f} %", f"{effect.cpu_seconds:.2g}", pointers


def _pilot(found: Quote) -> str:
    pilot = found.pilot
    return (
        f"Tried for {pilot.seconds:.1f} s: {counted(pilot.blocks, 'block')}, "
        f"{counted(pilot.pixels, 'pixel')}, {counted(pilot.target_errors, 'target error')}. "
        "Intervals are 95 % intervals."
    )
