"""The figures as tables for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from benchmarks.effects import SIDE
from benchmarks.passes import ERROR
from benchmarks.quotes import NEAR
from benchmarks.settings import Setting

if TYPE_CHECKING:
    from benchmarks.accuracy import Accuracy
    from benchmarks.bursts import Bursts
    from benchmarks.effects import EffectCost
    from benchmarks.lists import Lists
    from benchmarks.machine import Machine, Spread
    from benchmarks.meshes import MeshTiming
    from benchmarks.overhead import Overhead
    from benchmarks.passes import Passes
    from benchmarks.quotes import Quotes
    from benchmarks.rendering import Timing
    from benchmarks.scaling import Scaling
    from benchmarks.stability import Stability
    from benchmarks.targets import Summary, Targets


def of_machine(machine: Machine) -> Table:
    """Name and value of each line."""
    table = Table(title="machine", show_header=False)
    for name, value in machine.items():
        table.add_row(name, str(value))
    return table


def of_rendering(timings: list[Timing]) -> Table:
    """CPU seconds and shadow rays a second of each setting."""
    table = Table("setting", "CPU s", "least .. most", "shadow rays / s", title="one process")
    for timing in timings:
        rate = f"{timing['shadow_rays_a_second'] / 1e6:.1f} M"
        table.add_row(Setting(**timing["setting"]).name, *_cells(timing["cpu_seconds"]), rate)
    return table


def of_stages(timings: list[Timing]) -> Table:
    """Share of the time that each class of stage takes in each setting."""
    names = list(dict.fromkeys(name for timing in timings for name in timing["stages"]))
    table = Table(
        "stage", *(Setting(**timing["setting"]).name for timing in timings), title="share of the time"
    )
    for name in names:
        table.add_row(name, *(f"{timing['stages'].get(name, 0):.0%}" for timing in timings))
    return table


def of_effects(costs: list[EffectCost]) -> Table:
    """CPU seconds without and with each effect, what it adds to the counters, the same at strength zero."""
    columns = ("effect", "without, CPU s", "with", "ratio", "adds", "at zero: ratio", "adds", "plan, picture")
    table = Table(*columns, title=f"effects, {SIDE} x {SIDE} pixels, the fastest runs")
    for cost in costs:
        zero_ratio, zero_adds = cost["zero_ratio"], cost["zero_adds"]
        table.add_row(
            cost["effect"],
            f"{cost['without']['least']:.3f}",
            f"{cost['asked']['least']:.3f}",
            f"{cost['ratio']:.2f}",
            _counters(cost["adds"]),
            "" if zero_ratio is None else f"{zero_ratio:.2f}",
            "" if zero_adds is None else _counters(zero_adds),
            "" if cost["zero_same"] is None else "the same" if cost["zero_same"] else "other",
        )
    return table


def _counters(counts: dict[str, int]) -> str:
    names = {"shading_points": "points", "texture_lookups": "look-ups"}
    return ", ".join(f"{count:+,} {names.get(name, name)}" for name, count in counts.items()) or "nothing"


def of_meshes(timings: list[MeshTiming]) -> Table:
    """CPU seconds of each mesh, and how many times those of the ellipsoid they are."""
    columns = ("triangles", "CPU s", "least .. most", "x ellipsoid", "tree, CPU s")
    table = Table(*columns, title="a ball as a mesh, 512 x 512, 16 light points")
    one = timings[0]["cpu_seconds"]["median"]
    for timing in timings:
        name = str(timing["triangles"] or "ellipsoid")
        times = f"{timing['cpu_seconds']['median'] / one:.1f}"
        table.add_row(name, *_cells(timing["cpu_seconds"]), times, f"{timing['tree_seconds']:.2f}")
    return table


def of_scaling(scaling: Scaling) -> Table:
    """CPU seconds along each curve, and the power of what grows like which they do from line to line."""
    columns = ("over", "picture", "size", "CPU s", "least .. most", "power")
    table = Table(*columns, title="how the cost grows, one process")
    for point in scaling["points"]:
        power = "" if point["power"] is None else f"{point['power']:.2f}"
        table.add_row(
            point["over"], point["picture"], f"{point['size']:,}", *_cells(point["cpu_seconds"]), power
        )
    return table


def of_workers(scaling: Scaling) -> Table:
    """Wall seconds with one worker and with two, and how many times faster two are."""
    table = Table("picture", "1 worker, s", "least .. most", "2 workers, s", "least .. most", "ratio")
    table.title = "wall seconds, the start of the workers included"
    for each in scaling["workers"]:
        table.add_row(each["picture"], *_cells(each["one"]), *_cells(each["two"]), f"{each['ratio']:.2f}")
    return table


def of_accuracy(accuracies: list[Accuracy]) -> Table:
    """Error and cost of each setting."""
    table = Table("setting", "CPU s", "RMSE x 255", "mean x 255", title="against Mitsuba's converged picture")
    for accuracy in accuracies:
        table.add_row(
            Setting(**accuracy["setting"]).name,
            f"{accuracy['cpu_seconds']:.2f}",
            f"{accuracy['rmse_255']:.3f}",
            f"{accuracy['mean_difference_255']:+.3f}",
        )
    return table


def of_targets(sets: dict[str, Targets]) -> Table:
    """The target of each picture, its estimated error and its true error; below, all of each set."""
    columns = ("scene", "target", "estimate", "low .. high", "true", "true / target", "CPU s")
    caption = "\n".join(_of_set(name, found["summary"]) for name, found in sets.items())
    table = Table(*columns, title="target quality, errors x 255", caption=caption)
    for pair in (pair for found in sets.values() for pair in found["pairs"]):
        errors = (
            f"{pair['estimate']:.2f}",
            f"{pair['low']:.2f} .. {pair['high']:.2f}",
            f"{pair['true']:.2f}",
        )
        ratio = f"{pair['true'] / pair['target']:.2f}"
        table.add_row(pair["scene"], f"{pair['target']:g}", *errors, ratio, f"{pair['cpu_seconds']:.2f}")
    return table


def _of_set(name: str, total: Summary) -> str:
    low, middle, high = total["ratios"]
    return (
        f"{name}: of {total['pairs']} pairs {total['kept']} reach the target, {total['held']} intervals hold "
        f"the true error; true / target {middle:.2f} in the median, {low:.2f} to {high:.2f} from the 10th to "
        "the 90th percentile"
    )


def of_passes(found: Passes) -> Table:
    """Tiles of each pass, and what one process does alone."""
    columns = ("picture", "workers", "tiles of each pass", "CPU s", "between tiles", "seconds")
    table = Table(*columns, title=f"passes of soft at {255 * ERROR:g}/255")
    for one in found["shared"]:
        tiles = " ".join(map(str, one["tiles"]))
        serial = f"{one['serial_share']:.0%}"
        figures = f"{one['cpu_seconds']:.2f}", serial, f"{one['seconds']:.2f}"
        table.add_row(f"{one['side']} x {one['side']}", str(one["workers"]), tiles, *figures)
    return table


def of_late(found: Passes) -> Table:
    """How late pictures are that their time limit ends."""
    columns = ("picture", "workers", "layers", "limit s", "first pass s", "late s")
    table = Table(*columns, title="pictures of soft that a time limit ends")
    for one in found["late"]:
        names = f"{one['side']} x {one['side']}", str(one["workers"]), str(one["layers"])
        table.add_row(*names, f"{one['limit']:g}", f"{one['first_pass']:.2f}", f"{one['late']:+.2f}")
    return table


def of_quotes(quotes: Quotes) -> Table:
    """What each picture was predicted to take, and what it took; below, all of them."""
    fixed, target = (
        f"{mode}: {total['predictions']} predictions, {total['near']:.1%} within {NEAR:.0%}, "
        f"{total['held']:.1%} in their interval, median of measured / predicted {total['median_ratio']:.2f}"
        for mode, total in (("fixed samples", quotes["fixed"]), ("target errors", quotes["target"]))
    )
    caption = f"{fixed}\n{target}\nlongest pilot {quotes['longest_pilot']:.2f} s"
    columns = ("scene", "quality", "predicted CPU s", "low .. high", "measured", "ratio")
    table = Table(*columns, title="quotes", caption=caption)
    for each in quotes["predictions"]:
        numbers = (
            f"{each['predicted']:.2f}",
            f"{each['low']:.2f} .. {each['high']:.2f}",
            f"{each['measured']:.2f}",
        )
        table.add_row(each["scene"], each["quality"], *numbers, f"{each['measured'] / each['predicted']:.2f}")
    return table


def of_prices(stability: Stability) -> Table:
    """CPU seconds of kernels and pictures by all ways, and how many times the textbooks' ours are."""
    columns = ("part", "CPU s", "textbook, float32", "ratio", "the same, factored", "ratio")
    table = Table(*columns, title="what stability costs, the fastest rounds")
    for price in (*stability["prices"]["kernels"], *stability["prices"]["pictures"]):
        ours, *others = (price["seconds"][way] for way in ("penumbra", "textbook", "factored"))
        compared = ((f"{other:.3f}", f"{ours / other:.2f}") if other else ("", "") for other in others)
        table.add_row(price["name"], f"{ours:.3f}", *(cell for cells in compared for cell in cells))
    return table


def of_picture_errors(stability: Stability) -> Table:
    """Shares of pixels that are wrong in the pictures of all ways."""
    ways = ("penumbra", "textbook", "factored")
    table = Table("scene", "moved by", *ways, "textbook, too dark", title="pixels off by more than 1/255")
    for each in stability["errors"]:
        shares = (f"{each['off'][way]:.3%}" for way in ways)
        table.add_row(each["scene"], f"{each['offset']:g}", *shares, f"{each['dark']['textbook']:.3%}")
    return table


def of_bursts(bursts: Bursts) -> Table:
    """What became of both bursts, a line for each figure."""
    first = bursts["different"]
    title = f"{first['jobs']} jobs at once by {first['users']} users, {bursts['workers']} workers"
    table = Table("", "different scenes", "one scene", title=title)
    both = bursts["different"], bursts["same"]
    table.add_row("refused, sent again", *(str(burst["refusals"]) for burst in both))
    table.add_row("lost", *(str(burst["lost"]) for burst in both))
    table.add_row("accepted a second", *(str(burst["accepts_a_second"]) for burst in both))
    table.add_row("all finished after, s", *(str(burst["seconds"]) for burst in both))
    table.add_row("mean wait of a user, s", *(_range(burst["waits"]) for burst in both))
    table.add_row("Jain's index of speeds", *(str(burst["jain"]) for burst in both))
    table.add_row("first tile after, s", *(_range(burst["first_tile"]) for burst in both))
    return table


def _range(seconds: Spread) -> str:
    return f"{seconds['median']:.2f} ({seconds['least']:.2f} .. {seconds['most']:.2f})"


def of_overhead(overhead: Overhead) -> Table:
    """Wall seconds of the same job on every way."""
    table = Table("way", "s", "least .. most", title=f"one job, {overhead['workers']} workers")
    table.add_row("penumbra render", *_cells(overhead["command"]))
    table.add_row("renderer.render", *_cells(overhead["call"]))
    table.add_row("running service", *_cells(overhead["service"]))
    table.add_row("service / penumbra render", f"{overhead['ratio_to_command']:.2f}", "")
    table.add_row("service / renderer.render", f"{overhead['ratio_to_call']:.2f}", "")
    table.add_row("submitted to first pixels", *_cells(overhead["first_pixels"]))
    return table


def _cells(seconds: Spread) -> tuple[str, str]:
    return f"{seconds['median']:.3f}", f"{seconds['least']:.3f} .. {seconds['most']:.3f}"


def of_lists(lists: Lists) -> Table:
    """CPU milliseconds, statements and files of each look at a full service."""
    title = f"{lists['queued']:,} jobs queued and {lists['kept']:,} kept"
    table = Table("look", "CPU ms", "statements", "files listed", title=title)
    for name, look in lists["looks"].items():
        table.add_row(name, f"{look['cpu_ms']:.1f}", str(look["statements"]), f"{look['files']:,}")
    return table
