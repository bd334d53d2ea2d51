from __future__ import annotations

import socket

import numpy as np
import pytest

from service.cli.errors import CommandError
from service.cli.tev import create_image, parsed, update_image
from tests.tev_server import TevServer


@pytest.mark.parametrize("address", ["studio:port", "studio:0", "studio:65536", ":14158", "a:b:c", ""])
def test_invalid_address(address: str) -> None:
    with pytest.raises(CommandError, match="Write HOST:PORT"):
        parsed(address)


def test_rectangles_land_in_place() -> None:
    tev = TevServer()
    pixels = np.arange(2 * 3 * 3, dtype=np.float32).reshape(2, 3, 3)
    with socket.create_connection(parsed(tev.address)) as viewer:
        viewer.sendall(create_image("grün", 5, 4))
        viewer.sendall(update_image("grün", 1, 2, pixels))
    tev.close()
    found = tev.picture("grün")
    assert found.shape == (4, 5, 3)
    np.testing.assert_array_equal(found[2:4, 1:4], pixels)
    assert np.count_nonzero(found) == np.count_nonzero(pixels)
