"""Every setting of every renderer on one scene: its error, and what it costs."""

from __future__ import annotations

import importlib
import statistics
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, TypedDict

import renderer
from accuracy.variations import label
from benchmarks import povray_pictures, references
from benchmarks.machine import cpu_seconds
from benchmarks.peers_settings import FIXED, MITSUBA, POVRAY, Effort, asked
from schemas.quality import TargetQuality
from schemas.reading import read_scene

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import ArrayLike

    from benchmarks.povray_pictures import PovraySetting
    from renderer.plan.plan import RenderPlan
    from schemas.quality import Quality
    from schemas.scene import Scene

OURS = "Penumbra"
"""Target quality, which is compared with the others."""
OURS_FIXED = "Penumbra fixed"
PEER = "Mitsuba"
POV = "POV-Ray"
RENDERERS = (PEER, POV, OURS, OURS_FIXED)

SHORT = 2.0
"""CPU seconds of a run above which it counts alone."""
FIRST_SEED = 1000
"""Of Mitsuba's timed pictures: no reference was made with it, so their errors know nothing of each other."""


class Run(TypedDict):
    """One setting of one renderer: CPU seconds, errors of linear values clipped to 0..1 in units of 1/255.

    `rmse_255` is the true error, without the reference's own; `asked_255` the target error.
    """

    renderer: str
    setting: str
    asked_255: float | None
    cpu_seconds: float
    rmse_255: float
    mean_difference_255: float


@dataclass(frozen=True)
class _Picture:
    renderer: str
    setting: str
    seconds: float
    image: ArrayLike
    asked_255: float | None = None


def mitsuba() -> Any | None:
    """Give the module that has Mitsuba render, or None where Mitsuba or LLVM is missing."""
    try:
        return importlib.import_module("benchmarks.peer_pictures")
    except ImportError:
        return None


def runs_of(scene: str, errors_255: Iterable[float], effort: Effort) -> Iterator[Run]:
    """Render a scene with all renderers that are there and can say it.

    Each way of asking goes from cheap to expensive settings, until one has taken longer than the effort
    allows; numbers of samples end where one is nearer than the least of `errors_255`, too.
    """
    converged, provenance = references.load(scene)
    errors = list(errors_255)
    for pictures in _ladders(scene, errors, effort):
        for picture in pictures:
            error = references.true_rmse_255(picture.image, converged, provenance.own_error_255)
            yield Run(
                renderer=picture.renderer,
                setting=picture.setting,
                asked_255=picture.asked_255,
                cpu_seconds=round(picture.seconds, 3),
                rmse_255=round(error, 4),
                mean_difference_255=round(references.mean_difference_255(picture.image, converged), 3),
            )
            near_enough = picture.asked_255 is None and error < min(errors)
            if near_enough or picture.seconds > effort.longest:
                break


def _ladders(scene: str, errors_255: list[float], effort: Effort) -> Iterator[Iterator[_Picture]]:
    """Ways to ask for the picture, one renderer after another."""
    yield _by_mitsuba(scene, effort)
    if effort.thorough:
        yield _by_povray(scene, effort)
    for qualities in (asked(errors_255), *FIXED):
        yield _by_penumbra(scene, qualities, effort)


def _by_mitsuba(scene: str, effort: Effort) -> Iterator[_Picture]:
    peer = mitsuba()
    if peer is None:
        return
    path = references.PATHS[scene]
    document, _ = read_scene(path.read_bytes())
    prepared = peer.convert(document, path.parent)
    for samples in MITSUBA:
        draw = partial(_mitsuba, peer, prepared, document, samples)
        draw(0)  # compiles
        name = "1 sample" if samples == 1 else f"{samples} samples"
        yield _Picture(PEER, name, *_median(partial(_timed, draw), effort.runs))


def _mitsuba(peer: Any, prepared: Any, document: Scene, samples: int, number: int) -> ArrayLike:
    image: ArrayLike = peer.shot(prepared, document.camera, samples, FIRST_SEED + number)
    return image


def _by_povray(scene: str, effort: Effort) -> Iterator[_Picture]:
    if scene not in POVRAY or povray_pictures.version() is None:
        return
    document, _ = read_scene(references.PATHS[scene].read_bytes())
    start = statistics.median(povray_pictures.start_seconds(document) for _ in range(effort.runs))
    for setting in POVRAY[scene]:
        seconds, image = _median(partial(_povray, document, setting), effort.runs)
        yield _Picture(POV, setting.label, seconds - start, image)


def _povray(scene: Scene, setting: PovraySetting, _number: int) -> tuple[float, ArrayLike]:
    return povray_pictures.picture(scene, setting)


def _by_penumbra(scene: str, qualities: Iterable[Quality], effort: Effort) -> Iterator[_Picture]:
    for quality in qualities:
        plan = renderer.compile_scene(references.PATHS[scene], quality)
        seconds, image = _median(partial(_timed, partial(_penumbra, plan)), effort.runs)
        if isinstance(quality, TargetQuality):
            yield _Picture(OURS, label(quality), seconds, image, asked_255=round(255 * quality.error, 4))
        else:
            yield _Picture(OURS_FIXED, label(quality), seconds, image)


def _penumbra(plan: RenderPlan, _number: int) -> ArrayLike:
    return renderer.render(plan).image


def _timed(draw: Callable[[int], ArrayLike], number: int) -> tuple[float, ArrayLike]:
    begun = cpu_seconds()
    image = draw(number)
    return cpu_seconds() - begun, image


def _median(once: Callable[[int], tuple[float, ArrayLike]], runs: int) -> tuple[float, ArrayLike]:
    """CPU seconds in the median of some runs after one that warms caches up, and the picture of the last."""
    first = once(0)
    if first[0] > SHORT:
        return first
    timed = [once(number) for number in range(1, runs + 1)]
    return statistics.median(seconds for seconds, _ in timed), timed[-1][1]
