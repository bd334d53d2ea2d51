"""Sentences that answer users' questions from the results of a study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any

from accuracy.study import curves
from accuracy.study.settings import TARGET
from accuracy.study.tables import pointers
from accuracy.study.words import error, figure, seconds

Document = Mapping[str, Any]

ERRORS_255 = (4.0, 2.0, 1.0, 0.5, 0.25)
"""Errors in the answers, in units of 1/255: from a preview to less than 8 bits can show."""

ASKED_SECONDS = 10.0
"""Times in the answers, seconds."""

NEGLIGIBLE_CHANGE = 0.1
"""A change below this share of the picture's error is negligible: errors add in squares, so it changes the
error by 0.5 %."""

MAX_EXTRAPOLATION = 8.0
"""Errors are extrapolated up to so many times the seconds of the most expensive setting."""


def answers(document: Document) -> list[dict[str, str]]:
    """Questions and their answers."""
    questions = (
        ("How long for this error?", _how_long),
        ("Which pattern should I use?", _which_pattern),
        ("Which effect costs most?", _which_effect),
        ("Is double precision worth it?", _double),
        (f"What error in {ASKED_SECONDS:g} s?", _what_error),
    )
    return [{"question": question, "answer": " ".join(answer(document))} for question, answer in questions]


def about(document: Document) -> str:
    """The size to which all figures apply, and their growth to the scene's own size."""
    size = f"All figures are for {document['width']} x {document['height']} pixels."
    own = f"{document['own_width']} x {document['own_height']}"
    if (document["own_width"], document["own_height"]) == (document["width"], document["height"]):
        return f"{size} That is the scene's own size."
    ratio, measured = own_size_ratio(document)
    how = "measured" if measured else "by the number of pixels"
    return (
        f"{size} The scene's own {own} take {figure(ratio)} times as long ({how}); errors along edges are "
        "smaller there, as fewer pixels have one."
    )


def own_size_ratio(document: Document) -> tuple[float, bool]:
    """The cost of the scene's own size over that of the study's, and whether it was measured."""
    if document["size"]:
        return document["size"]["ratio"], True
    own, studied = (document[f"{p}width"] * document[f"{p}height"] for p in ("own_", ""))
    return own / studied, False


def _how_long(document: Document) -> Iterator[str]:
    front = curves.front(document["settings"])
    if not front:
        yield "No setting was tried whose error the reference can distinguish from 0."
        return
    for requested in ERRORS_255:
        # A setting whose interval contains the requested error may reach it.
        enough = [row for row in front if row["rmse_255"]["low"] <= requested]
        if enough:
            yield f"{error(requested)}: {seconds(curves.seconds(enough[0]))} with {enough[0]['name']}."
    yield f"The smallest error tried is {error(curves.error(front[-1]))}."


def _which_pattern(document: Document) -> Iterator[str]:
    table = [(row["rmse_255"], _of_patterns(row["cpu_seconds"])) for row in document["equal_error"]]
    table = [(level, costs) for level, costs in table if len(costs) > 1]
    if not table:
        yield "No two patterns were tried that reach the same error."
        return
    yield _quickest(table) + "."
    # The smallest error that most patterns reach: there they differ most.
    most = max(len(costs) for _, costs in table)
    level, costs = [row for row in table if len(row[1]) == most][-1]
    best = min(costs, key=lambda method: costs[method])
    others = sorted((cost / costs[best], method) for method, cost in costs.items() if method != best)
    yield f"For {error(level)}, {best} takes {seconds(costs[best])};"
    yield ", ".join(f"{method} takes {figure(ratio)} times as long" for ratio, method in others) + "."


def _of_patterns(costs: Mapping[str, float]) -> dict[str, float]:
    return {method: cost for method, cost in costs.items() if method != TARGET}


def _quickest(table: Sequence[tuple[float, Mapping[str, float]]]) -> str:
    """The quickest pattern for each range of errors: `rotated down to 4/255, sobol down to 1/255`."""
    best = [(min(costs, key=lambda method: costs[method]), level) for level, costs in table]
    # Errors are in falling order: the last one for which a pattern is the quickest ends its run.
    runs = [list(run)[-1] for _, run in groupby(best, key=itemgetter(0))]
    return ", ".join(f"{method} for errors down to {error(level)}" for method, level in runs)


def _which_effect(document: Document) -> Iterator[str]:
    if not document["effects"]:
        yield "No effect of this scene was left out."
        return
    # Camera samples multiply all the others: the settings cover them.
    row = next(
        (row for row in document["effects"] if row["effect"] != "antialiasing"), document["effects"][0]
    )
    yield (
        f"{row['effect']}: {seconds(row['cpu_seconds']['estimate'])}, {100 * row['share']:.0f} % of the "
        f"time, asked for by {pointers(row)}."
    )
    yield f"Without it the picture changes by {error(row['difference_255'])}."


def _double(document: Document) -> Iterator[str]:
    if not document["precision"]:
        yield "It was not tried."
        return
    rows = document["precision"]
    row = max(rows, key=lambda row: row["difference_255"] / max(row["rmse_255"], 1e-9))
    nothing = row["difference_255"] <= NEGLIGIBLE_CHANGE * row["rmse_255"]
    yield "No, not for this scene." if nothing else "Perhaps: it changes the picture."
    yield "It takes " + " and ".join(
        f"{figure(row['ratio']['estimate'])} times as long with {row['name']}" for row in rows
    )
    yield (
        f"and changes the picture by {error(row['difference_255'])}, where the error is "
        f"{error(row['rmse_255'])}."
    )


def _what_error(document: Document) -> Iterator[str]:
    front = curves.front(document["settings"])
    if not front:
        yield "It is not known."
        return
    yield _error_after(document, front, ASKED_SECONDS)
    if (document["own_width"], document["own_height"]) != (document["width"], document["height"]):
        ratio, _ = own_size_ratio(document)
        yield f"At the scene's own size, {ASKED_SECONDS:g} s are as {seconds(ASKED_SECONDS / ratio)} here:"
        yield _error_after(document, front, ASKED_SECONDS / ratio)


def _error_after(document: Document, front: list[curves.Row], spent: float) -> str:
    between = curves.error_at(front, spent)
    if between is not None:
        return f"about {error(between)}, between settings that were tried."
    if spent < curves.seconds(front[0]):
        least = seconds(curves.seconds(front[0]))
        return f"nothing that was tried is as quick; {front[0]['name']} takes {least}."
    last = front[-1]
    power = next(row["order"] for row in document["methods"] if row["method"] == last["method"])
    reached = f"less than {error(curves.error(last))}, which {last['name']} reaches"
    reached += f" in {seconds(curves.seconds(last))}"
    times = spent / curves.seconds(last)
    if times > MAX_EXTRAPOLATION or power is None or power["high"] is None or power["high"] >= 0:
        return f"{reached}."
    low, middle, high = (curves.error(last) * times ** power[end] for end in ("low", "estimate", "high"))
    return f"{reached}; if it keeps falling at this rate, {error(middle)} ({figure(low)} to {figure(high)})."
