"""Quotes: what a picture would cost and how large its error would be, predicted by a pilot of a second."""

from time import monotonic, thread_time

from accuracy.quotes.choices import Adaptive, Fixed, closest, soonest
from accuracy.quotes.pilots import Pilot
from accuracy.quotes.settings import LADDER_ERRORS
from renderer.adaptive.forecast import price
from renderer.compiling import compile_scene
from renderer.scenes import LoadedScene
from schemas.api.plans import EffectShare, Offer, Quote
from schemas.api.plans import Pilot as PilotReport
from schemas.quality import Quality

PILOT_SECONDS = 1.5
"""CPU seconds that a pilot may take."""

__all__ = ["PILOT_SECONDS", "quote"]


def quote(
    scene: LoadedScene,
    quality: Quality | None = None,
    *,
    target_error: float | None = None,
    seconds: float | None = None,
    workers: int = 1,
    limit: float = PILOT_SECONDS,
) -> Quote:
    """Predict cost and error of a picture at several qualities.

    The price comes from the plan alone. Everything else comes from a pilot in this process. As far as there
    is time, it renders the requested quality first, then times blocks of the picture, leaves out effects,
    samples pixels twice, and tries other target errors. Results without time are missing, and rough guesses
    are marked.

    Parameters
    ----------
    scene : LoadedScene
    quality : Quality, optional
        The requested quality, in place of the scene's own sampling.
    target_error : float, optional
        A requested error, 1e-6 to 1.
    seconds : float, optional
        An available time.
    workers : int
        Processes that will render.
    limit : float
        CPU seconds of the pilot; on a busy machine it takes at most `deadlines.WALL_RATIO` times as many
        seconds of wall-clock time. No unit of work begins that would exceed it by the longest one so far. The
        first compilation of the scene is not counted, since every picture needs it.

    Returns
    -------
    schemas.api.plans.Quote

    Raises
    ------
    SceneError
        If the scene, or a file that it names, cannot be used.

    Notes
    -----
    The order of pixels depends on the scene and its seed alone. Their number, and so every figure but the
    price, depends on the machine.
    """
    before = thread_time()
    plan = compile_scene(scene, quality)
    pilot, begun = Pilot(scene, plan, thread_time() - before), monotonic()
    pilot.run(limit, target_error)
    fixed, adaptive = pilot.fixed(workers), pilot.adaptive(workers)
    known: list[Fixed | Adaptive] = [*fixed, adaptive]
    asked = _asked(pilot, fixed, adaptive)
    return Quote(
        asked=asked,
        offers=_offers(pilot, fixed, adaptive),
        for_error=soonest(known, target_error) if target_error else None,
        for_seconds=closest(known, seconds) if seconds else None,
        effects=_effects(pilot, asked),
        price=price(plan, workers),
        workers=workers,
        pilot=PilotReport(
            seconds=monotonic() - begun,
            blocks=sum(watch.blocks for watch in pilot.timings),
            pixels=pilot.sampled.pixels if pilot.sampled else 0,
            target_errors=len(pilot.rehearsals),
        ),
    )


def _asked(pilot: Pilot, fixed: list[Fixed], adaptive: Adaptive) -> Offer | None:
    if pilot.target is not None:
        return adaptive.priced(pilot.target.error, pilot.target.time_limit) if adaptive.tried else None
    return fixed[0].priced(pilot.asked) if fixed else None


def _offers(pilot: Pilot, fixed: list[Fixed], adaptive: Adaptive) -> tuple[Offer, ...]:
    """All prices: the ladders from few samples to many, then errors from large to small."""
    offers = []
    for each in fixed:
        own = {pilot.asked} if pilot.target is None and each is fixed[0] else set()
        offers += [each.priced(count) for count in sorted({*each.ladder.counts} | own)]
    errors = {*LADDER_ERRORS, *adaptive.tried} if adaptive.tried else ()
    return (*offers, *map(adaptive.priced, sorted(errors, reverse=True)))


def _effects(pilot: Pilot, asked: Offer | None) -> tuple[EffectShare, ...]:
    total = asked.cpu_seconds.estimate if asked else 0.0
    return tuple(
        EffectShare(effect=one.effect, pointers=one.pointers, cpu_seconds=share * total, share=share)
        for one, share in sorted(pilot.effects, key=lambda found: -found[1])
        if asked
    )
