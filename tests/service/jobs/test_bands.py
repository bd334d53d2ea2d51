"""Pictures assembled from bands, and tiles whose files are damaged."""

from pathlib import Path

import numpy as np
import pytest

from renderer.images.files import encode_layer
from schemas.tiles import Pass, Tile
from service.errors import StoreDamagedError
from service.jobs.bands import Finished
from service.lifecycle.rows import documents_of
from service.storage.database.models import RenderRow
from service.storage.folder import Folder
from service.storage.tiles import StoredTile, TileStore

WIDE, HIGH, STRIDE = 600, 1000, 8


def rows_of(finished: Finished, store: TileStore) -> tuple[np.ndarray, np.ndarray, int]:
    """A picture and its depths, assembled from bands, and the number of bands."""
    pixels, sheets = zip(*finished.bands(store, ["depth"]), strict=True)
    return np.concatenate(pixels), np.concatenate([sheet["depth"] for sheet in sheets]), len(pixels)


@pytest.mark.parametrize("merges", [[], [{"attempt": 1}]])
def test_bands_have_every_tile_in_its_place(tmp_path: Path, merges: list[dict[str, int]]) -> None:
    """600,000 pixels are more than a band has; tiles lie at the top, in the middle and at the end."""
    random = np.random.default_rng(4)
    store = TileStore(Folder(tmp_path))
    store.put_spec("job", b"{}")
    coarse = random.random((HIGH // STRIDE, WIDE // STRIDE, 3), np.float32)
    expected = coarse.repeat(STRIDE, axis=0).repeat(STRIDE, axis=1)
    depths = np.full((HIGH, WIDE), np.inf, np.float32)
    whole, rough, fine = Tile(0, 0, 0, WIDE, HIGH), Pass(0, STRIDE, 0, 1), Pass(1, 1, 0, 1)
    preview = StoredTile(whole, rough, 1, store.put_tile("job", whole, rough, 1, coarse))
    if merges:
        store.put_map("job", 0, 1, "picture", expected)
    parts = []
    for tile in (Tile(0, 0, 0, 64, 64), Tile(1, 536, 500, 600, 564), Tile(2, 64, 960, 128, 1000)):
        there = slice(tile.y0, tile.y1), slice(tile.x0, tile.x1)
        depths[there] = random.random(depths[there].shape, np.float32)
        expected[there] = random.random(expected[there].shape, np.float32)
        store.put_layers("job", tile, fine, 1, {"depth": depths[there]})
        parts.append(StoredTile(tile, fine, 1, store.put_tile("job", tile, fine, 1, expected[there])))
    render = RenderRow(id="job", width=WIDE, height=HIGH, merges=merges)
    render.target_error = 0.01 if merges else None
    partial = rows_of(Finished("job", render, preview, tuple(parts), tuple(parts)), store)
    render.checksums = {}
    for name, values in (("image", expected), ("layer-depth", depths)):
        render.checksums |= documents_of(store.put_final("job", 1, f"{name}.npy", encode_layer(values)))
    render.image_sha256, render.final_prefix = "0" * 64, "1-"
    for pixels, sheet, bands in (partial, rows_of(Finished("job", render), store)):
        np.testing.assert_array_equal(pixels, expected)
        np.testing.assert_array_equal(sheet, depths)
        assert bands > 1


@pytest.mark.parametrize("harm", ["bit", "end"])
def test_layers_that_are_damaged_are_noticed(tmp_path: Path, harm: str) -> None:
    store, tile, pass_ = TileStore(Folder(tmp_path)), Tile(0, 0, 0, 4, 3), Pass(1, 1, 0, 1)
    store.put_spec("job", b"{}")
    store.put_layers("job", tile, pass_, 1, {"depth": np.ones((3, 4), np.float32)})
    stored = StoredTile(tile, pass_, 1, 0)
    assert np.all(next(store.get_layers("job", [stored]))["depth"] == 1)
    (file,) = (tmp_path / "job" / "tiles").iterdir()
    data = bytearray(file.read_bytes())
    place = data.index(np.float32(1).tobytes())
    file.write_bytes(data[:place] if harm == "end" else data[:place] + b"\x01" + data[place + 1 :])
    with pytest.raises(StoreDamagedError):
        next(store.get_layers("job", [stored]))
