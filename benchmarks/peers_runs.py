"""Every setting of every renderer on one scene: its error, and what it costs."""

from __future__ import annotations

import importlib
import statistics
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, TypedDict

import renderer
from benchmarks import povray_pictures, references
from benchmarks.machine import cpu_seconds
from benchmarks.peers_settings import MITSUBA, PENUMBRA, POVRAY, label
from schemas.reading import read_scene

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import ArrayLike

    from benchmarks.povray_pictures import PovraySetting
    from renderer.plan import RenderPlan
    from schemas.scene import Scene

RUNS = 3
"""Timed runs of a setting, after one that compiles and warms caches up; the median counts."""
SHORT = 2.0
"""CPU seconds above which the first run counts, but for Mitsuba, which compiles in it."""
LONGEST = 60.0
"""CPU seconds after which nothing dearer is asked for in the same way."""


class Run(TypedDict):
    """One setting of one renderer: CPU seconds, errors of linear values clipped to 0..1 in units of 1/255."""

    renderer: str
    setting: str
    cpu_seconds: float
    rmse_255: float
    mean_difference_255: float


@dataclass(frozen=True)
class _Picture:
    renderer: str
    setting: str
    seconds: float
    image: ArrayLike


def mitsuba() -> Any | None:
    """Give the module that has Mitsuba render, or None where Mitsuba or LLVM is missing."""
    try:
        return importlib.import_module("benchmarks.peer_pictures")
    except ImportError:
        return None


def runs_of(scene: str) -> Iterator[Run]:
    """Render a scene with all renderers that are there and can say it, from cheap settings to dear ones."""
    converged, _ = references.load(scene)
    for pictures in (_by_mitsuba(scene), _by_povray(scene), _by_penumbra(scene)):
        for picture in pictures:
            yield Run(
                renderer=picture.renderer,
                setting=picture.setting,
                cpu_seconds=round(picture.seconds, 3),
                rmse_255=round(references.rmse_255(picture.image, converged), 3),
                mean_difference_255=round(references.mean_difference_255(picture.image, converged), 3),
            )


def _by_mitsuba(scene: str) -> Iterator[_Picture]:
    peer = mitsuba()
    if peer is None:
        return
    path = references.PATHS[scene]
    document, _ = read_scene(path.read_bytes())
    prepared = peer.convert(document, path.parent)
    for samples in MITSUBA:
        once = partial(_timed, partial(peer.shot, prepared, document.camera, samples))
        yield _Picture("Mitsuba", f"{samples} samples", *_median(once, compiles=True))


def _by_povray(scene: str) -> Iterator[_Picture]:
    if scene not in POVRAY or povray_pictures.version() is None:
        return
    document, _ = read_scene(references.PATHS[scene].read_bytes())
    start = statistics.median(povray_pictures.start_seconds(document) for _ in range(RUNS))
    for setting in POVRAY[scene]:
        seconds, image = _median(partial(_povray, document, setting))
        yield _Picture("POV-Ray", setting.label, seconds - start, image)


def _povray(scene: Scene, setting: PovraySetting, _number: int) -> tuple[float, ArrayLike]:
    return povray_pictures.picture(scene, setting)


def _by_penumbra(scene: str) -> Iterator[_Picture]:
    for qualities in PENUMBRA:
        for quality in qualities:
            plan = renderer.compile_scene(references.PATHS[scene], quality)
            seconds, image = _median(partial(_timed, partial(_penumbra, plan)))
            yield _Picture("Penumbra", label(quality), seconds, image)
            if seconds > LONGEST:
                break


def _penumbra(plan: RenderPlan, _number: int) -> ArrayLike:
    return renderer.render(plan).image


def _timed(draw: Callable[[int], ArrayLike], number: int) -> tuple[float, ArrayLike]:
    begun = cpu_seconds()
    image = draw(number)
    return cpu_seconds() - begun, image


def _median(
    once: Callable[[int], tuple[float, ArrayLike]], *, compiles: bool = False
) -> tuple[float, ArrayLike]:
    """CPU seconds in the median of some runs, by the number of the run, and the picture of the last."""
    first = once(0)
    if first[0] > SHORT and not compiles:
        return first
    runs = [once(number) for number in range(1, RUNS + 1)]
    return statistics.median(seconds for seconds, _ in runs), runs[-1][1]
