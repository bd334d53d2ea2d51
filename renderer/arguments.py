"""Arguments of `render` and `trace` that a type checker would reject, for callers without one."""

from operator import index

from renderer.plan.plan import RenderPlan
from renderer.processors import usable_processors
from renderer.workers import START_AFTER

MOST_WORKERS = 1024
"""Worker processes, at most; a service has the same bound."""

LARGEST_TILE = 1 << 16
"""Side of a tile, pixels: no picture has more."""


def check_plan(plan: object, function: str) -> None:
    """Refuse whatever is not a plan.

    Raises
    ------
    TypeError
        Says how to make one.
    """
    if not isinstance(plan, RenderPlan):
        kind = type(plan).__name__
        raise TypeError(f"{function} takes a plan, not {kind}. Make one with renderer.compile_scene(scene).")


def checked_count(name: str, value: object, most: int, otherwise: str) -> int | None:
    """Give a number of things from 1 to `most`, or None.

    Parameters
    ----------
    otherwise
        Meaning of None, for the message.

    Raises
    ------
    TypeError
        It is not a whole number; NumPy's are taken.
    ValueError
        It is out of range.
    """
    if value is None:
        return None
    message = f"{name} must be a whole number from 1 to {most}, or None for {otherwise}, not {value!r}."
    try:
        # True is the number 1 to Python, but not to a caller that writes workers=True.
        count = None if isinstance(value, bool) else index(value)  # type: ignore[arg-type]
    except TypeError:
        count = None
    if count is None:
        raise TypeError(message)
    if not 1 <= count <= most:
        raise ValueError(message)
    return count


def worker_count(workers: object) -> tuple[int | None, float]:
    """Number of workers requested from `render`, and the CPU seconds after which they start.

    Raises
    ------
    TypeError, ValueError
        If it is neither a number of workers, "auto", nor None.
    """
    if workers == "auto":
        return usable_processors(), START_AFTER
    return checked_count("workers", workers, MOST_WORKERS, "this process alone"), 0.0


def check_callable(name: str, value: object) -> None:
    """Refuse what can be neither called nor left out.

    Raises
    ------
    TypeError
        Says what it must be.
    """
    if value is not None and not callable(value):
        kind = type(value).__name__
        raise TypeError(f"{name} must be a function that takes a renderer.TileEvent, or None, not {kind}.")
