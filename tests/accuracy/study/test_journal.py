"""The journal of a study survives interruptions."""

from pathlib import Path

import numpy as np
import pytest

from accuracy.study.journal import JOURNAL, Journal

PICTURE = np.arange(24, dtype=np.float32).reshape(2, 4, 3)


def test_journal_is_kept_when_it_is_opened_again(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.add({"key": "a", "cpu_seconds": 1.5}, PICTURE)
    with pytest.raises(ValueError, match="JSON"):
        journal.add({"key": "c", "cpu_seconds": float("nan")})
    before = (tmp_path / JOURNAL).read_bytes()
    journal.add({"key": "b", "cpu_seconds": 0.5})
    assert (tmp_path / JOURNAL).read_bytes().startswith(before)
    again = Journal(tmp_path)
    assert (len(again), "b" in again, "c" in again) == (2, True, False)
    assert again["a"]["cpu_seconds"] == 1.5
    assert np.array_equal(again.picture("a"), PICTURE)
    assert not again.has_picture("b")


@pytest.mark.parametrize("left", [1, 2, 10, 28, 29])
def test_line_that_was_cut_off_is_ignored(tmp_path: Path, left: int) -> None:
    journal = Journal(tmp_path)
    journal.add({"key": "a", "cpu_seconds": 1.0})
    whole = (tmp_path / JOURNAL).read_bytes()
    journal.add({"key": "b", "cpu_seconds": 2.0})
    (tmp_path / JOURNAL).write_bytes((tmp_path / JOURNAL).read_bytes()[: len(whole) + left])
    torn = Journal(tmp_path)
    assert "b" not in torn
    torn.add({"key": "c", "cpu_seconds": 3.0})
    again = Journal(tmp_path)
    assert ("a" in again, "c" in again) == (True, True)
