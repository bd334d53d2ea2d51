from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest

from service.cli.errors import InputError
from service.cli.render import read_rays
from tests.service.cli.conftest import Penumbra

DOWN = np.array([[0.0, 9.0, 0.0], [1.5, 9.0, 1.5], [9.0, 9.0, 9.0]]), np.tile([0.0, -2.0, 0.0], (3, 1))


def test_hits_file(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "rays.npz", origins=DOWN[0], directions=DOWN[1])
    outcome = here("trace", scene_file, "rays.npz", "-o", "hits.npz", "--json")
    assert outcome.code == 0
    assert (outcome.document["hits"], outcome.document["misses"]) == (2, 1)
    with np.load(tmp_path / "hits.npz") as hits:
        assert set(hits) == {"t", "position", "normal", "uv", "shape", "primitive", "visibility"}
        assert hits["shape"].tolist() == [1, 0, -1]
        assert hits["t"].tolist() == [3.75, 4.5, np.inf]
        assert hits["visibility"].shape == (3, 1)


WRONG = {
    "no directions": ({"origins": DOWN[0]}, "no array 'directions'"),
    "two columns": ({"origins": DOWN[0][:, :2], "directions": DOWN[1]}, r"'origins' has shape \(3, 2\)"),
    "other lengths": ({"origins": DOWN[0], "directions": DOWN[1][:2]}, "3 origins but 2 directions"),
    "words": ({"origins": np.full((3, 3), "x"), "directions": DOWN[1]}, "'origins' holds <U1"),
    "not finite": ({"origins": DOWN[0], "directions": np.diag([1, 1, np.nan])}, "row 2 of 'directions'"),
    "no direction": (
        {"origins": DOWN[0], "directions": np.diag([1.0, 0, 1])},
        "row 1 of 'directions' is zero",
    ),
    "objects": ({"origins": np.array([None]), "directions": DOWN[1]}, "not an .npz file"),
}


@pytest.mark.parametrize(("arrays", "message"), WRONG.values(), ids=WRONG)
def test_unusable_rays_name_array_and_row(
    tmp_path: Path, arrays: dict[str, np.ndarray], message: str
) -> None:
    np.savez(tmp_path / "rays.npz", **arrays)
    with pytest.raises(InputError, match=message):
        read_rays(tmp_path / "rays.npz")


def test_far_origin_names_its_row(here: Penumbra, scene_file: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "rays.npz", origins=np.diag([1, 1e200, 1]), directions=DOWN[1])
    outcome = here("trace", scene_file, "rays.npz", "-o", "hits.npz")
    assert outcome.code == 3
    assert re.search("rays.npz: .*row 1 of 'origins'", outcome.err)
    assert not (tmp_path / "hits.npz").exists()


def _single_array() -> bytes:
    file = io.BytesIO()
    np.save(file, DOWN[0])
    return file.getvalue()


@pytest.mark.parametrize("content", [b"", b"text", b"PK\x03\x04 cut off", b"\x93NUMPY", _single_array()])
def test_file_that_is_no_archive(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "rays.npz").write_bytes(content)
    with pytest.raises(InputError, match="savez"):
        read_rays(tmp_path / "rays.npz")
