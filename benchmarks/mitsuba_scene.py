"""Hand a scene to Mitsuba 3: its shapes as Mitsuba's own, its materials as tables by shape.

Mitsuba intersects; materials and lights stay numbers, because the radiance formula is ours. Lights are
left out of the geometry, as they cast no shadow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from schemas.lights import Light, ParallelogramLight, RectangleLight
from schemas.shapes import Ellipsoid, MeshFile, Parallelogram, Rectangle, Shape, Sphere, Triangle

mi.set_variant("llvm_ad_rgb")

# Tables of materials are arrays of the variant, which is chosen before they are defined.
from benchmarks.mitsuba_materials import Materials, materials_of  # noqa: E402

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from schemas.scene import Scene


@dataclass(frozen=True)
class AreaLight:
    """Points corner + u e1 + v e2 with u, v in [0, 1], as seen by the peer.

    `area` is that of a light whose brightness falls with the distance, or None. Places are scalars: Dr.Jit
    widens a literal 0 that is multiplied by an array to the array's length, and it would not fit the next.
    """

    corner: Any
    edges: tuple[Any, Any]
    color: Any
    visible: bool
    two_sided: bool
    area: float | None


@dataclass(frozen=True)
class PeerScene:
    """Parameters of the peer's integrator; `index_of` maps shape numbers to rows of materials."""

    geometry: Any
    index_of: Any
    materials: Materials
    lights: list[AreaLight]
    background: Any
    ambient: Any


def convert(scene: Scene, folder: Path) -> PeerScene:
    """Build the peer's scene, whose files are in a folder; it refuses what no compared scene has."""
    shapes = [_shape(shape, folder) for shape in scene.shapes]
    geometry = mi.load_dict({"type": "scene"} | {f"shape{i}": shape for i, shape in enumerate(shapes)})
    numbers = [dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0] for shape in shapes]
    index_of = np.zeros(max(numbers) + 1, dtype=np.uint32)
    index_of[numbers] = np.arange(len(shapes))
    return PeerScene(
        geometry=geometry,
        index_of=mi.UInt32(index_of),
        materials=materials_of(scene, folder),
        lights=[_light(light) for light in scene.lights],
        background=mi.Color3f(*scene.background),
        ambient=mi.Color3f(*scene.ambient),
    )


def _shape(shape: Shape, folder: Path) -> Any:
    match shape:
        case Triangle(normals=None):
            return _triangle(shape)
        case Rectangle() | Parallelogram():
            return mi.load_dict({"type": "rectangle", "to_world": _rectangle_transform(shape)})
        case Ellipsoid():
            return _ellipsoid(shape.center, np.array(shape.axes))
        case Sphere():
            return mi.load_dict({"type": "sphere", "center": list(shape.center), "radius": shape.radius})
        case MeshFile() if shape.asset.endswith(".ply"):
            return _mesh(shape, folder)
    raise ValueError(f"the peer's scene has no {shape.type} with these fields")


def _mesh(shape: MeshFile, folder: Path) -> Any:
    """The peer reads the file itself and forms vertex normals of its own."""
    turned = mi.ScalarTransform4f().translate(list(shape.translate))
    if shape.rotate is not None:
        turned = turned.rotate(list(shape.rotate.axis), shape.rotate.degrees)
    factors = [float(factor) for factor in np.broadcast_to(shape.scale, 3)]
    file = {"type": "ply", "filename": str(folder / shape.asset), "face_normals": not shape.smooth}
    return mi.load_dict(file | {"to_world": turned.scale(factors)})


def _triangle(shape: Triangle) -> Any:
    mesh = mi.Mesh("triangle", vertex_count=3, face_count=1)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(np.ravel(shape.vertices))
    parameters["faces"] = mi.UInt32([0, 1, 2])
    parameters.update()
    return mesh


def _rectangle_transform(shape: Rectangle | Parallelogram) -> Any:
    corner, first, second = _corner_and_edges(shape)
    world_from_square = np.eye(4)
    center = corner + first / 2 + second / 2
    world_from_square[:3] = np.stack([first / 2, second / 2, np.cross(first, second), center], axis=1)
    return mi.ScalarTransform4f(world_from_square)


def _ellipsoid(center: tuple[float, float, float], axes: NDArray[np.float64]) -> Any:
    lengths = np.linalg.norm(axes, axis=1)
    rotation = axes / lengths[:, None]
    if np.linalg.det(rotation) < 0:
        rotation[2] *= -1
    quaternion = dr.matrix_to_quat(mi.ScalarMatrix3f(rotation.T))
    return mi.load_dict(
        {
            "type": "ellipsoids",
            "centers": mi.TensorXf(np.array([center], dtype=np.float32)),
            "scales": mi.TensorXf(lengths[None].astype(np.float32)),
            "quaternions": mi.TensorXf(np.array(quaternion, dtype=np.float32)[None]),
            "extent": 1.0,
        }
    )


def _light(light: Light) -> AreaLight:
    if not isinstance(light, RectangleLight | ParallelogramLight):
        raise ValueError(f"the peer's scene has no {light.type} light")
    corner, first, second = _corner_and_edges(light)
    area = float(np.linalg.norm(np.cross(first, second)))
    return AreaLight(
        corner=mi.ScalarPoint3f(corner),
        edges=(mi.ScalarVector3f(first), mi.ScalarVector3f(second)),
        color=mi.Color3f(*light.color),
        visible=light.visible,
        two_sided=light.two_sided,
        area=area if light.falloff == "physical" else None,
    )


def _corner_and_edges(
    rectangle: Rectangle | Parallelogram | RectangleLight | ParallelogramLight,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Write both forms of a rectangle as corner, first edge and second edge, each of shape (3,)."""
    if isinstance(rectangle, Parallelogram | ParallelogramLight):
        first, second = np.array(rectangle.edges)
        return np.array(rectangle.corner), first, second
    normal = np.array(rectangle.normal) / np.linalg.norm(rectangle.normal)
    tangent = np.array(rectangle.tangent) - np.dot(rectangle.tangent, normal) * normal
    tangent /= np.linalg.norm(tangent)
    first, second = rectangle.size[0] * tangent, rectangle.size[1] * np.cross(normal, tangent)
    return np.array(rectangle.center) - first / 2 - second / 2, first, second
