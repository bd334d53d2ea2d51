import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.api.batches import FLOAT32, RGB8, BatchHead, TileHead
from service.client.batches import decode_batch
from service.client.errors import UnexpectedAnswerError


def _batch(*tiles: tuple[TileHead, bytes], encoding: int = RGB8) -> bytes:
    head = BatchHead(encoding, tiles=len(tiles), next=9, complete=True, succeeded=False)
    return b"".join([head.pack(), *(tile.pack() + pixels for tile, pixels in tiles)])


@given(
    x0=st.integers(0, 5),
    y0=st.integers(0, 5),
    width=st.integers(1, 9),
    height=st.integers(1, 9),
    stride=st.integers(1, 10),
)
def test_tile_paints_its_rectangle(x0: int, y0: int, width: int, height: int, stride: int) -> None:
    rows, columns = -(-height // stride), -(-width // stride)
    pixels = np.arange(1, rows * columns * 3 + 1, dtype="<f4").reshape(rows, columns, 3)
    head = TileHead(9, 0, x0, y0, x0 + width, y0 + height, stride, pixels.nbytes)
    batch = decode_batch(_batch((head, pixels.tobytes()), encoding=FLOAT32))
    canvas = np.zeros((16, 16, 3), np.float32)
    batch.tiles[0].paint(canvas)
    for y, x in np.ndindex(16, 16):
        inside = x0 <= x < x0 + width and y0 <= y < y0 + height
        expected = pixels[(y - y0) // stride, (x - x0) // stride] if inside else np.zeros(3)
        assert np.array_equal(canvas[y, x], expected)


@pytest.mark.parametrize("cut", range(1, 20))
def test_truncated_batch_is_refused(cut: int) -> None:
    data = _batch((TileHead(1, 1, 0, 0, 2, 1, 1, 6), bytes(6)))
    with pytest.raises(UnexpectedAnswerError):
        decode_batch(data[:-cut])


def test_pixels_that_do_not_fit_are_refused() -> None:
    with pytest.raises(UnexpectedAnswerError):
        decode_batch(_batch((TileHead(1, 1, 0, 0, 2, 2, 1, 6), bytes(6))))
