"""What was rendered is known afterwards, whatever happened."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from accuracy.study.journal import JOURNAL, Journal

PICTURE = np.arange(24, dtype=np.float32).reshape(2, 4, 3)


def test_runs_and_pictures_are_there_when_the_journal_is_opened_again(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.add({"key": "a", "cpu_seconds": 1.5}, PICTURE)
    journal.add({"key": "b", "cpu_seconds": 0.5})
    again = Journal(tmp_path)
    assert len(again) == 2
    assert again["a"]["cpu_seconds"] == 1.5
    assert np.array_equal(again.picture("a"), PICTURE)
    assert "b" in again
    assert not again.has_picture("b")
    assert "c" not in again


@pytest.mark.parametrize("left", range(1, 30))
def test_a_line_that_was_cut_off_anywhere_is_as_if_it_had_not_been(tmp_path: Path, left: int) -> None:
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


def test_the_file_is_only_added_to(tmp_path: Path) -> None:
    Journal(tmp_path).add({"key": "a"})
    before = (tmp_path / JOURNAL).read_bytes()
    Journal(tmp_path).add({"key": "b"})
    assert (tmp_path / JOURNAL).read_bytes().startswith(before)


def test_a_number_that_json_does_not_have_is_refused(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    with pytest.raises(ValueError, match="not JSON compliant"):
        journal.add({"key": "a", "cpu_seconds": float("nan")})
