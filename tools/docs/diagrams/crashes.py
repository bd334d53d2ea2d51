"""Diagrams of crashes: a worker that is killed, the states of a tile, and a server that loses its term."""

from __future__ import annotations

from tools.docs.diagrams.drawing import (
    BLOCKED,
    FAINT,
    INK,
    LIGHT,
    OPEN,
    PAPER,
    SMALL,
    SOLID,
    Place,
    arrow,
    box,
    cross,
    dot,
    label,
    labels,
    line,
    picture,
)

LEFT, RIGHT = 96, 700
"""Where lanes begin and end."""

DATABASE, SERVER, FIRST, SECOND, FILES = 66, 130, 194, 258, 322
"""Lanes of the time line of a killed worker."""


def killed_worker() -> str:
    """What happens from the claim of a tile until it is finished by another worker."""
    lanes = {"database": DATABASE, "server": SERVER, "worker 1": FIRST, "worker 2": SECOND, "files": FILES}
    return picture(
        372,
        "A tile whose worker is killed",
        "A time line. A transaction claims tile 7 for attempt 1, and worker 1 renders it until it is killed. "
        "The end of its pipe reaches the server. One transaction counts the death, lets the tile wait, and "
        "claims it for attempt 2. Worker 2 renders it, writes its file and reports a checksum; a transaction "
        "records it as finished.",
        [
            *(part for name, y in lanes.items() for part in _lane(name, y)),
            *_transaction(140, ("tile 7: running,", "attempt 1")),
            arrow((140, SERVER), (156, FIRST - 10)),
            *_work(FIRST, 158, 280, "attempt 1"),
            cross((280, FIRST)),
            label((280, FIRST + 24), "killed", size=SMALL, color=BLOCKED),
            dot((256, FILES), SOLID, hollow=True),
            labels((256, FILES + 22), ("temporary file,", "never in place"), size=SMALL),
            arrow((286, FIRST - 12), (318, SERVER + 5), BLOCKED, dashed=True),
            label((290, FIRST - 34), "its pipe ends", anchor="end", size=SMALL),
            *_transaction(338, ("waiting, 1 death;", "running, attempt 2")),
            arrow((338, SERVER), (362, SECOND - 10)),
            box((370, FIRST - 9), (RIGHT - 370, 18), PAPER, edge=SOLID, round_by=4, dashed=True),
            label((452, FIRST + 4), "a new process takes its place", size=SMALL),
            *_work(SECOND, 364, 520, "attempt 2"),
            arrow((512, SECOND + 10), (512, FILES - 6)),
            dot((512, FILES)),
            labels((512, FILES + 22), ("file 1-7.2 moved", "into place"), size=SMALL),
            arrow((522, SECOND - 10), (584, SERVER + 6)),
            label((566, SECOND - 14), "done, checksum", anchor="start", size=SMALL),
            *_transaction(602, ("tile 7: done,", "event 31")),
        ],
    )


def _lane(name: str, y: float) -> list[str]:
    """A thin line for one of those that take part."""
    return [label((LEFT - 10, y + 5), name, anchor="end"), line((LEFT, y), (RIGHT, y), FAINT)]


def _transaction(x: float, texts: tuple[str, str]) -> list[str]:
    """Something that the server writes to the database."""
    return [
        line((x, SERVER), (x, DATABASE), OPEN, width=2),
        box((x - 7, DATABASE - 7), (14, 14), OPEN),
        dot((x, SERVER), OPEN),
        labels((x, DATABASE - 34), texts, size=SMALL),
    ]


def _work(y: float, begin: float, end: float, text: str) -> list[str]:
    """A stretch of time in which a process is at something."""
    return [
        box((begin, y - 10), (end - begin, 20), LIGHT, round_by=4),
        label(((begin + end) / 2, y + 4), text, size=SMALL),
    ]


def task_states() -> str:
    """The states of a tile of one pass, and what moves it between them."""
    return picture(
        290,
        "The states of a tile",
        "A tile of a pass waits, runs, and is done. A claim moves it from waiting to running and counts an "
        "attempt; a report of that attempt moves it to done. If its worker dies, or if the task is "
        "interrupted, the disk cannot be written, or the server is lost, it waits again. After three deaths "
        "or an error of its own the render fails.",
        [
            *_state((40, 80), "waiting"),
            *_state((300, 80), "running"),
            *_state((560, 80), "done"),
            *_state((560, 196), "render failed"),
            arrow((160, 94), (298, 94)),
            labels((229, 62), ("claimed:", "attempt + 1"), size=SMALL),
            arrow((420, 105), (558, 105)),
            labels((489, 74), ("reported:", "checksum, event"), size=SMALL),
            arrow((300, 116), (162, 116), BLOCKED, dashed=True),
            labels((40, 152), _AGAIN, anchor="start", size=SMALL),
            arrow((400, 132), (558, 214), BLOCKED, dashed=True),
            labels((440, 196), ("the third death, or", "an error of its own"), anchor="end", size=SMALL),
            labels(
                (40, 262),
                ("A report of another attempt than the current one changes nothing.",),
                anchor="start",
                size=14,
            ),
        ],
    )


_AGAIN = (
    "worker died: deaths + 1",
    "task interrupted, disk full or away,",
    "server or database lost: no death",
)


def _state(corner: Place, name: str) -> list[str]:
    """A box with a name."""
    return [
        box(corner, (120, 50), PAPER, edge=INK, round_by=8),
        label((corner[0] + 60, corner[1] + 30), name, bold=True),
    ]


def terms() -> str:
    """Two servers, of which the first is suspended and finds that another leads when it continues."""
    first, lease, second = 66, 140, 214
    late, back = 316, 470
    return picture(
        272,
        "A leader that is suspended",
        "Server A leads in term 4 and is suspended. Its lease expires in the database after three seconds. "
        "Server B leads in term 5 and takes back A's tiles. When A continues, its next transaction finds "
        "term 5 and writes nothing.",
        [
            *_lane("server A", first),
            *_lane("lease", lease),
            *_lane("server B", second),
            *_span(first, LEFT, 216, LIGHT, "leads, term 4"),
            *_span(first, 216, back, PAPER, "suspended"),
            *_span(lease, LEFT, late, LIGHT, "A, term 4"),
            *_span(lease, late, RIGHT, OPEN, "B, term 5", color=PAPER),
            *_span(
                second, late + 12, RIGHT, OPEN, "leads: A's tiles wait again, and are claimed", color=PAPER
            ),
            labels((late, lease + 26), ("3 s without a renewal",), size=SMALL),
            arrow((late, second), (late, lease + 34), OPEN),
            arrow((back, first + 10), (back, lease - 11), BLOCKED, dashed=True),
            labels(
                (back + 12, first - 4),
                ("its transaction finds term 5:", "it writes nothing"),
                anchor="start",
                size=SMALL,
            ),
            labels(
                (LEFT, 258),
                ("B checks the lease twice a second, by the database's clock.",),
                anchor="start",
                size=14,
            ),
        ],
    )


def _span(y: float, begin: float, end: float, fill: str, text: str, *, color: str = INK) -> list[str]:
    """A stretch of a lane with words in it."""
    return [
        box((begin, y - 11), (end - begin, 22), fill, edge=SOLID),
        label(((begin + end) / 2, y + 4), text, size=SMALL, color=color),
    ]
