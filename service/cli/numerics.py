"""``penumbra doctor --numerics``: the self-test of arithmetic and of exact answers."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import typer

from service.cli import output
from service.cli.errors import ExitCode

if TYPE_CHECKING:
    from accuracy.self_test import Answer


def check_numerics(*, as_json: bool) -> None:
    """Run the self-test and show every answer; typer.Exit if one is wrong."""
    from accuracy.self_test import answers

    begun = time.perf_counter()
    found = list(answers())
    wrong = [answer for answer in found if not answer.right]
    seconds = round(time.perf_counter() - begun, 3)
    total = {"cases": len(found), "right": len(found) - len(wrong), "wrong": len(wrong), "seconds": seconds}
    document = {"cases": [asdict(answer) for answer in found], "total": total}
    output.report(document, _lines(found), as_json=as_json)
    if wrong:
        raise typer.Exit(ExitCode.BELOW_THRESHOLD)


def _lines(found: Sequence[Answer]) -> Iterator[str]:
    for answer in found:
        mark = output.emphasis(*("ok   ", "green") if answer.right else ("wrong", "red"))
        yield f"{mark} {answer.name}"
        if not answer.right:
            yield from (f"      {line}" for line in (answer.error, answer.cure) if line)
    wrong = sum(not answer.right for answer in found)
    yield f"{len(found)} answers: " + (f"{wrong} wrong." if wrong else "all right.")
