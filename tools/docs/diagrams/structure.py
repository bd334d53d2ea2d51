"""Diagrams of the architecture: the life of a job, the life of a ray, the states of an adaptive picture."""

from __future__ import annotations

from tools.docs.diagrams.drawing import (
    INK,
    PAPER,
    SMALL,
    SOLID,
    TEXT,
    Place,
    arrow,
    box,
    curve,
    label,
    labels,
    line,
    loop,
    picture,
)

CLIENT, ROUTES, DATABASE, DISPATCHER, WORKER, FILES = range(6)
LANES = ("client", "routes", "database", "dispatcher", "worker", "files")
MESSAGES = (
    (CLIENT, ROUTES, "POST /v1/jobs"),
    (ROUTES, ROUTES, "read, check, compile, price"),
    (ROUTES, DATABASE, "job and all its steps"),
    (ROUTES, CLIENT, "202, id"),
    (ROUTES, DISPATCHER, "there is work"),
    (DISPATCHER, DATABASE, "results and claims"),
    (DISPATCHER, WORKER, "a tile of a pass"),
    (WORKER, FILES, "pixels"),
    (WORKER, DISPATCHER, "done, checksum"),
    (DISPATCHER, DATABASE, "step done, event"),
    (DISPATCHER, ROUTES, "news of the job"),
    (ROUTES, CLIENT, "events, pixels"),
    (DISPATCHER, WORKER, "compose"),
    (WORKER, FILES, "the picture"),
    (DISPATCHER, DATABASE, "succeeded"),
    (CLIENT, ROUTES, "GET image.png"),
)
ROUND = range(5, 12)
"""The messages that follow each other until all steps are done."""


def job() -> str:
    """Who sends what to whom, from the request to the picture."""
    first, step = 62, 27
    height = first + step * len(MESSAGES)
    top, bottom = first + step * ROUND.start - 16, first + step * ROUND.stop - 19
    return picture(
        height + 6,
        "The life of a job",
        "The client sends a scene to the routes, which enter the job and all its steps in the database, "
        "answer with its id and wake the dispatcher. In each round the dispatcher writes results and claims "
        "in one transaction and gives tiles to workers, which store pixels and report a checksum; the client "
        "gets events and pixels. After the last step a worker composes the picture.",
        [
            box((12, top), (696, bottom - top), edge=SOLID, round_by=8, dashed=True),
            label((698, top + 18), "until all steps are done", anchor="end", size=SMALL, halo=True),
            *(line((_lane(n), 34), (_lane(n), height - 8), SOLID, width=1) for n in range(len(LANES))),
            *(label((_lane(n), 24), name, bold=True) for n, name in enumerate(LANES)),
            *(part for n, sent in enumerate(MESSAGES) for part in _message(first + step * n, *sent)),
        ],
    )


def _lane(number: int) -> float:
    return 62 + 119 * number


def _message(y: float, sender: int, receiver: int, text: str) -> list[str]:
    """An arrow with words above it; a note where both are the same."""
    if sender == receiver:
        return [label((_lane(sender) + 8, y + 2), text, anchor="start", size=SMALL, halo=True)]
    begin, end = _lane(sender), _lane(receiver)
    return [
        arrow((begin, y), (end, y)),
        label(((begin + end) / 2, y - 5), text, size=SMALL, halo=True),
    ]


def ray() -> str:
    """What becomes of a scene on its way to a tile."""
    return picture(
        330,
        "The life of a ray",
        "A scene is compiled to a plan. For a block of pixels the sampler makes camera rays; the families of "
        "shapes find the nearest hits, which become points. Each light makes pairs of points and light "
        "points, shapes block some of them, and the others add light to the points. The film takes means "
        "over the samples of each pixel and gives a tile.",
        [
            *_part((90, 50), "scene", ""),
            *_part((270, 50), "plan", "stages"),
            *_part((450, 50), "block", "pixels x samples"),
            *_part((630, 50), "camera rays", "float64"),
            *_part((630, 170), "nearest hits", "float64"),
            *_part((450, 170), "points", "float64"),
            *_part((270, 170), "film", "means of samples"),
            *_part((90, 170), "tile", ""),
            *_part((540, 290), "pairs", "with light points, float32"),
            *_part((300, 290), "lit pairs", "that see the light"),
            *_joined((155, 50), (205, 50), "compile"),
            *_joined((335, 50), (385, 50), ""),
            *_joined((515, 50), (565, 50), "sampler"),
            arrow((640, 74), (640, 146)),
            labels((632, 90), ("each family", "of shapes"), anchor="end"),
            *_joined((565, 170), (515, 170), "colours"),
            *_joined((385, 170), (335, 170), ""),
            *_joined((205, 170), (155, 170), ""),
            curve([(600, 146), (600, 126), (270, 126)]),
            arrow((270, 126), (270, 146)),
            label((360, 120), "misses, visible lights", size=SMALL),
            arrow((490, 194), (530, 266)),
            labels((524, 226), ("each light:", "which points face it"), anchor="start"),
            arrow((458, 290), (366, 290)),
            labels((414, 310), ("each family:", "which are blocked"), size=SMALL),
            arrow((330, 266), (410, 194)),
            label((352, 236), "diffuse, highlight", anchor="end", size=SMALL),
        ],
    )


def _part(middle: Place, name: str, detail: str) -> list[str]:
    """A box with a name and what is to know of it."""
    half = 82 if len(detail) > 20 else 65
    lines = [label((middle[0], middle[1] + (-3 if detail else 5)), name, bold=True)]
    if detail:
        lines.append(label((middle[0], middle[1] + 14), detail, size=SMALL))
    return [box((middle[0] - half, middle[1] - 24), (2 * half, 48), PAPER, edge=INK, round_by=6), *lines]


def _joined(begin: Place, end: Place, text: str) -> list[str]:
    """An arrow from box to box, and what happens on the way."""
    middle = ((begin[0] + end[0]) / 2, begin[1] - 7)
    return [arrow(begin, end), *([label(middle, text, size=SMALL)] if text else [])]


def states() -> str:
    """The states of a picture of target quality, and what follows on each."""
    return picture(
        236,
        "The states of a picture of target quality",
        "Through a pinhole a picture begins in PREVIEW, which repeats with a finer lattice, and goes on to "
        "BORDERS and PROBES. Through a lens it begins in LATTICE, which repeats too, and goes on to PROBES. "
        "From there it is DONE if the error is reached, or goes to SAMPLE, which repeats until it is.",
        [
            *_state((124, 90), "PREVIEW"),
            *_state((270, 90), "BORDERS"),
            *_state((404, 90), "PROBES"),
            *_state((538, 90), "SAMPLE"),
            *_state((658, 90), "DONE"),
            *_state((124, 200), "LATTICE"),
            *_begin((72, 90), "pinhole"),
            *_begin((72, 200), "lens"),
            *(
                arrow((x + 48, 90), (following - 50, 90))
                for x, following in ((124, 270), (270, 404), (404, 538))
            ),
            arrow((586, 90), (608, 90)),
            curve([(172, 200), (390, 200)]),
            arrow((390, 200), (390, 114)),
            curve([(418, 112), (418, 160), (658, 160)]),
            arrow((658, 160), (658, 114)),
            label((540, 153), "error reached", size=SMALL),
            loop((124, 68)),
            loop((124, 178)),
            loop((538, 68)),
            label((124, 28), "finer lattice", size=SMALL),
            label((124, 138), "finer lattice", size=SMALL),
            label((538, 28), "more samples", size=SMALL),
        ],
    )


def _state(middle: Place, name: str) -> list[str]:
    """A box with the name of a state."""
    return [
        box((middle[0] - 48, middle[1] - 22), (96, 44), PAPER, edge=INK, round_by=8),
        label((middle[0], middle[1] + 5), name, bold=True, size=TEXT),
    ]


def _begin(end: Place, text: str) -> list[str]:
    """Where a picture begins."""
    return [arrow((end[0] - 56, end[1]), end), label((end[0] - 30, end[1] - 8), text, size=SMALL)]
