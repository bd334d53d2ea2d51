"""Pixels along edges and along thin shapes, against the places that rays say they are in."""

import numpy as np

from renderer.adaptive.edges import edge_places
from renderer.adaptive.thin import narrow_places, thin_places
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, unit
from renderer.shapes.family import Hulls
from tests.pictures import pictures
from tests.pictures.parts import plan_of

SIZE = 64


def pinhole() -> Pinhole:
    document = pictures.of_room()
    document["camera"] |= {"width": SIZE, "height": SIZE}
    return plan_of(document).camera


def seen_through(camera: Pinhole, places: list[tuple[float, float]], depth: float) -> Floats:
    """Points (3, n) at a depth that the rays through places on the picture, column and row, hit."""
    x, y = np.array(places, dtype=np.float64).T
    rays = camera.directions(x, y)
    return camera.position + rays * (depth / (rays * camera.forward).sum(axis=0))


def hulls(corners: Floats) -> Hulls:
    """Those of one triangle, rectangles or balls, by their corners (V, 3, K)."""
    edges = {3: ((0, 1), (1, 2), (2, 0)), 4: ((0, 1), (0, 2), (1, 3), (2, 3)), 8: ()}
    return Hulls(np.arange(corners.shape[2]), corners, edges[corners.shape[0]])


def test_edge_marks_the_pixels_it_passes() -> None:
    camera = pinhole()
    places = [(3.2, 5.1), (60.7, 40.9), (-30.0, 80.0)]
    corners = seen_through(camera, places, 2.5).T[:, :, None]
    marked = set(map(tuple, edge_places(camera, hulls(corners)).T.tolist()))
    for (x0, y0), (x1, y1) in zip(places, [*places[1:], places[0]], strict=True):
        steps = np.linspace(0, 1, 100_000)
        x, y = x0 + steps * (x1 - x0), y0 + steps * (y1 - y0)
        inside = (x >= 0) & (x < SIZE) & (y >= 0) & (y < SIZE)
        passed, counts = np.unique(np.floor((x, y))[:, inside], axis=1, return_counts=True)
        long = counts * np.hypot(x1 - x0, y1 - y0) / 100_000 > 1
        assert set(map(tuple, passed[:, long].T.astype(int).tolist())) <= marked


def test_edge_behind_the_camera() -> None:
    camera = pinhole()
    ahead = seen_through(camera, [(32.0, 32.0), (10.0, 32.0)], 3.0)
    behind = camera.position - 5 * camera.forward - camera.up
    corners = np.hstack((ahead, behind)).T[:, :, None]
    columns, rows = edge_places(camera, hulls(corners))
    assert rows.max() == SIZE - 1
    assert {(32, 32), (10, 32)} <= set(zip(columns.tolist(), rows.tolist(), strict=True))


def test_edge_beside_the_picture() -> None:
    camera = pinhole()
    corners = seen_through(camera, [(70.0, 5.0), (90.0, 40.0), (80.0, 60.0)], 2.0).T[:, :, None]
    assert edge_places(camera, hulls(corners)).size == 0


def test_pole_is_thin() -> None:
    camera = pinhole()
    pole = seen_through(camera, [(20.5, 4.5), (21.0, 4.5), (20.5, 60.5), (21.0, 60.5)], 2.0)
    wall = seen_through(camera, [(2.0, 2.0), (62.0, 2.0), (2.0, 62.0), (62.0, 62.0)], 3.0)
    corners = np.stack((pole.T, wall.T), axis=2)
    columns, rows = thin_places(camera, hulls(corners))
    assert set(columns.tolist()) <= {20, 21}
    assert set(rows.tolist()) == set(range(4, 61))


def test_small_ball_is_thin() -> None:
    camera = pinhole()
    (middle,) = seen_through(camera, [(33.3, 21.7)], 4.0).T
    offsets = 0.01 * unit(np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]).T * 1.0).T
    corners = (middle + offsets)[:, :, None]
    assert (33, 21) in set(map(tuple, thin_places(camera, hulls(corners)).T.tolist()))


def box_of(camera: Pinhole, middle: tuple[float, float], half_width: float, half_length: float) -> Floats:
    """Corners (8, 3, 1) of the box around an upright ellipsoid at depth 4; sizes in pixels."""
    (centre,) = seen_through(camera, [middle], 4.0).T
    pixel = 4.0 * 2 * camera.half_width / SIZE
    axes = camera.right, camera.up, camera.forward
    sizes = pixel * np.array([half_width, half_length, half_width])
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    offsets = (signs * sizes) @ np.hstack(axes).T
    corners: Floats = (centre + offsets)[:, :, None]
    return corners


def test_round_post_is_narrow() -> None:
    camera = pinhole()
    post = narrow_places(camera, hulls(box_of(camera, (20.5, 32.0), 0.7, 20.0)))
    assert set(range(14, 51)) <= set(post[1].tolist())
    assert set(post[0].tolist()) <= {19, 20, 21}
    tips = narrow_places(camera, hulls(box_of(camera, (40.5, 32.0), 2.5, 26.0)))[1]
    assert tips.size > 2
    assert all(row < 12 or row > 52 for row in tips.tolist())


def test_large_ball_is_not_narrow() -> None:
    camera = pinhole()
    assert narrow_places(camera, hulls(box_of(camera, (32.0, 32.0), 12.0, 12.0))).size == 0
    pole = seen_through(camera, [(20.5, 4.5), (21.0, 4.5), (20.5, 60.5), (21.0, 60.5)], 2.0)
    assert narrow_places(camera, hulls(pole.T[:, :, None])).size == 0
