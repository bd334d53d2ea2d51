"""The radiance formula of the scene language, evaluated by Mitsuba on its own intersections.

A term that no shape of the scene asks for is left out when the peer compiles the formula.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi

if TYPE_CHECKING:
    from benchmarks.mitsuba_materials import Materials
    from benchmarks.mitsuba_scene import AreaLight, PeerScene


@dataclass(frozen=True)
class _Surface:
    """Hits of rays: true and shading normal on the viewer's side, and the material's numbers."""

    hit: Any
    viewer: Any
    true_normal: Any
    normal: Any
    material: dict[str, Any]
    color: Any


def radiance(peer: PeerScene, ray: Any, sampler: Any) -> Any:
    """Radiance along rays, one point of each light for each."""
    surface = _meet(peer, ray)
    value = peer.ambient * surface.material["ambient"] * surface.color
    for light in peer.lights:
        value += _from_light(peer, light, surface, sampler.next_2d())
    value = dr.select(surface.hit.is_valid(), value, peer.background)
    return _with_visible_lights(peer, ray, surface.hit.t, value)


def _meet(peer: PeerScene, ray: Any) -> _Surface:
    flags = mi.RayFlags.UV | mi.RayFlags.ShadingFrame
    if peer.materials.normals:
        flags |= mi.RayFlags.dPdUV
    # Neighbouring rays go almost the same way: it saves the peer a quarter of its time to know.
    hit = peer.geometry.ray_intersect(ray, ray_flags=flags, coherent=True)
    valid = hit.is_valid()
    index = dr.gather(mi.UInt32, peer.index_of, dr.reinterpret_array(mi.UInt32, hit.shape), valid)
    rows = peer.materials.rows
    material = {name: dr.gather(type(row), row, index, valid) for name, row in rows.items()}
    side = dr.select(dr.dot(hit.n, ray.d) > 0, -1, 1)
    return _Surface(
        hit=hit,
        viewer=-ray.d,
        true_normal=hit.n * side,
        normal=_facing(_normal(peer.materials, hit, index) * side, -ray.d),
        material=material,
        color=_color(peer.materials, material, hit, index),
    )


def _color(materials: Materials, material: dict[str, Any], hit: Any, index: Any) -> Any:
    color = material["color"]
    if "odd" in material:
        square = dr.floor(hit.uv * material["repeat"])
        odd = dr.abs(square.x + square.y - 2 * dr.floor((square.x + square.y) / 2)) > 0
        color = dr.select(odd, material["odd"], color)
    for image in materials.colors:
        used = dr.gather(mi.Bool, image.used, index, hit.is_valid())
        color = dr.select(used, image.at(hit.uv), color)
    return color


def _normal(materials: Materials, hit: Any, index: Any) -> Any:
    """Outward shading normals: smooth ones, and 2 c - 1 in (tangent, cotangent, normal) of normal maps."""
    normal = hit.sh_frame.n
    for image in materials.normals:
        used = dr.gather(mi.Bool, image.used, index, hit.is_valid())
        c = 2 * image.at(hit.uv) - 1
        tangent = dr.normalize(hit.dp_du - normal * dr.dot(normal, hit.dp_du))
        mapped = dr.normalize(c.x * tangent + c.y * dr.cross(normal, tangent) + c.z * normal)
        normal = dr.select(used, mapped, normal)
    return normal


def _facing(normal: Any, viewer: Any) -> Any:
    """Bend normals that face away from the viewer to the horizon."""
    toward = dr.dot(normal, viewer)
    return dr.select(toward > 0, normal, dr.normalize(normal - viewer * toward))


def _from_light(peer: PeerScene, light: AreaLight, surface: _Surface, point: Any) -> Any:
    target = light.corner + light.edges[0] * point.x + light.edges[1] * point.y
    way = target - surface.hit.p
    l = dr.normalize(way)
    cosine = dr.dot(surface.normal, l)
    faces = surface.hit.is_valid() & (cosine > 0) & (dr.dot(surface.true_normal, l) > 0)
    across = dr.dot(dr.normalize(dr.cross(*light.edges)), l)
    if not light.two_sided:
        faces &= across < 0
    seen = faces & ~peer.geometry.ray_test(surface.hit.spawn_ray_to(target), faces)
    reflected = _reflected(surface, l, cosine)
    if light.area is not None:
        reflected *= dr.abs(across) * light.area / (dr.pi * dr.squared_norm(way))
    return dr.select(seen, light.color * reflected, 0)


def _reflected(surface: _Surface, l: Any, cosine: Any) -> Any:
    material = surface.material
    r = 2 * cosine * surface.normal - l
    highlight = dr.power(dr.maximum(0, dr.dot(r, surface.viewer)), material["shininess"])
    return material["diffuse"] * surface.color * cosine + material["specular"] * highlight


def _with_visible_lights(peer: PeerScene, ray: Any, nearest: Any, value: Any) -> Any:
    for light in peer.lights:
        if light.visible:
            distance = _distance(light, ray)
            value = dr.select(distance < nearest, light.color, value)
            nearest = dr.minimum(nearest, distance)
    return value


def _distance(light: AreaLight, ray: Any) -> Any:
    """Triple products, as a parallelogram's edges need not be perpendicular."""
    normal = dr.cross(*light.edges)
    facing = dr.dot(ray.d, normal)
    offset = ray.o - light.corner
    turned = dr.cross(offset, ray.d)
    u, v = -dr.dot(turned, light.edges[1]) / facing, dr.dot(turned, light.edges[0]) / facing
    t = -dr.dot(offset, normal) / facing
    inside = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1) & (t > 0)
    if not light.two_sided:
        inside &= facing < 0
    return dr.select(inside, t, dr.inf)
