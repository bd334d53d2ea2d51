"""CPU seconds at equal true error, ours and Mitsuba's, in half an hour.

It needs the group `bench` and LLVM 17 or newer. Each picture is compared with a converged reference. Seconds
are user and system time of all threads, without loading and compiling.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from accuracy.plotting import BLUE, CYAN, RED, drawn
from benchmarks.peers_runs import ERRORS_255, OURS, OURS_FIXED, PEER, SCENES, Run, runs_of
from benchmarks.report import OUT, keep, parser, show

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from matplotlib.figure import Figure

COLORS = {PEER: RED, OURS: BLUE, OURS_FIXED: CYAN}


def main() -> None:
    """Measure the requested scenes, print the comparison, and keep it with a plot."""
    options = parser("peers", __doc__)
    options.add_argument("scenes", nargs="*", default=[*SCENES], metavar="SCENE", help=", ".join(SCENES))
    runs: dict[str, list[Run]] = {}
    compared: list[dict[str, Any]] = []
    for scene in options.parse_args().scenes:
        runs[scene] = list(runs_of(scene))
        compared += (comparison(scene, runs[scene], error) for error in ERRORS_255)
    columns = ("scene", "RMSE x 255", PEER, OURS, OURS_FIXED, f"{OURS} / {PEER}", "asked: CPU s", "its RMSE")
    show("CPU seconds at equal true error", columns, [(*each.values(),) for each in compared])
    keep("peers", {"comparisons": compared, "runs": runs})
    (OUT / "peers.svg").write_bytes(drawn(lambda figure: fill(figure, runs), (12, 3.4 * -(-len(runs) // 3))))


def comparison(scene: str, runs: Sequence[Run], error_255: float) -> dict[str, Any]:
    """Seconds of each renderer at an error, their ratio, and what a user gets who asks for it."""
    seconds = {
        name: seconds_at([run for run in runs if run["renderer"] == name], error_255) for name in COLORS
    }
    ours, theirs = seconds[OURS], seconds[PEER]
    asked = next((run for run in runs if run["asked_255"] == error_255), None)
    return {
        "scene": scene,
        "error_255": error_255,
        **{name: seconds[name] for name in (PEER, OURS, OURS_FIXED)},
        "ratio": None if ours is None or theirs is None else ours / theirs,
        "asked_seconds": asked and asked["cpu_seconds"],
        "asked_rmse_255": asked and asked["rmse_255"],
    }


def front(runs: Iterable[Run]) -> list[Run]:
    """Runs that come nearer than all cheaper ones, the cheapest first."""
    nearer: list[Run] = []
    for run in sorted(runs, key=lambda run: (run["cpu_seconds"], run["rmse_255"])):
        if not nearer or run["rmse_255"] < nearer[-1]["rmse_255"]:
            nearer.append(run)
    return nearer


def seconds_at(runs: Iterable[Run], error_255: float) -> float | None:
    """CPU seconds to an error, between two runs on a line in logarithms; None where it is not reached.

    If the cheapest run is already more accurate, the error costs as much as that run.
    """
    best = front(runs)
    if not best or error_255 < best[-1]["rmse_255"]:
        return None
    if error_255 >= best[0]["rmse_255"]:
        return best[0]["cpu_seconds"]
    coarser, nearer = next(pair for pair in pairwise(best) if pair[1]["rmse_255"] <= error_255)
    if nearer["rmse_255"] == 0:
        return nearer["cpu_seconds"]
    way = math.log(coarser["rmse_255"] / error_255) / math.log(coarser["rmse_255"] / nearer["rmse_255"])
    return coarser["cpu_seconds"] * math.pow(nearer["cpu_seconds"] / coarser["cpu_seconds"], way)


def fill(figure: Figure, scenes: Mapping[str, Sequence[Run]]) -> None:
    """A panel for each scene: error against CPU seconds."""
    for place, (scene, runs) in enumerate(scenes.items(), start=1):
        panel = figure.add_subplot(-(-len(scenes) // 3), 3, place)
        for name, color in COLORS.items():
            best = front(run for run in runs if run["renderer"] == name)
            places = [run["cpu_seconds"] for run in best], [run["rmse_255"] for run in best]
            panel.plot(*places, color=color, marker="o", markersize=4, label=name)
        panel.set(xscale="log", yscale="log", title=scene, xlabel="CPU seconds", ylabel="RMSE x 255")
        panel.grid(visible=True, which="both", alpha=0.2)
        panel.legend(frameon=False)


if __name__ == "__main__":
    main()
