"""Time as counted by heartbeats."""

import os
from multiprocessing import Pipe

from service.workers.heartbeats import Lease, Passed, beats

SECONDS = 0.02


def test_beats_that_waited_are_not_silence() -> None:
    listening, sending = Pipe(duplex=False)
    os.write(sending.fileno(), b"...")
    assert next(beats(listening, SECONDS)) == Passed(3 * SECONDS, 0.0)


def test_silence_is_counted_until_the_next_beat() -> None:
    listening, sending = Pipe(duplex=False)
    reported = beats(listening, SECONDS)
    assert next(reported) == Passed(2 * SECONDS, 2 * SECONDS)
    assert next(reported) == Passed(2 * SECONDS, 4 * SECONDS)
    os.write(sending.fileno(), b".")
    assert next(reported) == Passed(SECONDS, 0.0)
    sending.close()
    assert next(reported, None) is None


def test_beats_are_several_before_silence_counts() -> None:
    assert Lease(silent_seconds=1.0).beat_seconds == 0.25
    assert Lease(silent_seconds=60.0).beat_seconds == 1.0
