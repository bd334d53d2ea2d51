"""The parts of a glTF 2.0 document that have a counterpart in scenes.

Source: Khronos Group, glTF 2.0 specification, and its extensions KHR_lights_punctual, KHR_materials_ior and
KHR_materials_transmission. Lengths are metres, angles radians, matrices are stored column by column.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import ConfigDict, Field
from pydantic.alias_generators import to_camel

from schemas.materials import RefractiveIndex, Share
from schemas.quantities import Color, Coordinate, Index, Intensity, Number, Point
from service.converting.errors import wrong_at
from service.converting.reading import Foreign

Item = TypeVar("Item")

_NAMES = frozenset({"name", "extras"})

Four = tuple[Number, Number, Number, Number]
Angle = Annotated[float, Field(strict=True, gt=0, lt=3.14159, allow_inf_nan=False)]
HalfAngle = Annotated[float, Field(strict=True, ge=0, lt=1.5708, allow_inf_nan=False)]
Ratio = Annotated[float, Field(strict=True, gt=0, le=1e3, allow_inf_nan=False)]
Text = Annotated[str, Field(strict=True)]


class Part(Foreign):
    """Base of all parts: names as glTF writes them."""

    # Parts are made only from documents, never from keyword arguments.
    model_config = ConfigDict(alias_generator=to_camel)
    SILENT: ClassVar[frozenset[str]] = _NAMES  # type: ignore[pydantic-alias]


class Buffer(Part):
    """Bytes."""

    uri: Text | None = None
    byte_length: Index


class BufferView(Part):
    """A part of a buffer."""

    SILENT: ClassVar[frozenset[str]] = _NAMES | {"target"}

    buffer: Index
    byte_offset: Index = 0
    byte_length: Index
    byte_stride: Index | None = None


class Accessor(Part):
    """Numbers in a part of a buffer."""

    SILENT: ClassVar[frozenset[str]] = _NAMES | {"min", "max"}

    buffer_view: Index | None = None
    byte_offset: Index = 0
    component_type: Index
    normalized: bool = False
    count: Index
    type: Text
    sparse: Any = None


class Primitive(Part):
    """Triangles of one material."""

    REASONS: ClassVar[dict[str, str]] = {
        "targets": "Morph targets are left out: the mesh keeps its base shape."
    }

    attributes: dict[str, Index]
    indices: Index | None = None
    material: Index | None = None
    mode: Index = 4


class Mesh(Part):
    """Triangles of several materials."""

    SILENT: ClassVar[frozenset[str]] = _NAMES | {"weights"}

    primitives: tuple[Primitive, ...]


class LightUse(Part):
    """Light of a node."""

    light: Index


class NodeExtensions(Part):
    """Extensions of a node."""

    lights: LightUse | None = Field(default=None, alias="KHR_lights_punctual")


class Node(Part):
    """A node: a transform, with a mesh, camera or light."""

    SILENT: ClassVar[frozenset[str]] = _NAMES | {"weights"}
    REASONS: ClassVar[dict[str, str]] = {"skin": "Skins are left out: the mesh keeps its base shape."}

    children: tuple[Index, ...] = ()
    mesh: Index | None = None
    camera: Index | None = None
    matrix: Annotated[tuple[Number, ...], Field(min_length=16, max_length=16)] | None = None
    translation: Point = (0.0, 0.0, 0.0)
    rotation: Four = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[Coordinate, Coordinate, Coordinate] = (1.0, 1.0, 1.0)
    extensions: NodeExtensions = NodeExtensions()


class SceneNodes(Part):
    """The nodes at the top of a scene."""

    nodes: tuple[Index, ...] = ()


class TextureUse(Part):
    """A texture of a material."""

    REASONS: ClassVar[dict[str, str]] = {"extensions": "Texture transforms are left out."}

    index: Index
    tex_coord: Index = 0
    scale: Number = 1.0


class Roughness(Part):
    """`pbrMetallicRoughness`."""

    REASONS: ClassVar[dict[str, str]] = {
        "metallicRoughnessTexture": "A material has one roughness: only the factor counts."
    }

    base_color_factor: tuple[Share, Share, Share, Share] = (1.0, 1.0, 1.0, 1.0)
    base_color_texture: TextureUse | None = None
    metallic_factor: Share = 1.0
    roughness_factor: Share = 1.0


class Transmission(Part):
    """`KHR_materials_transmission`."""

    REASONS: ClassVar[dict[str, str]] = {"transmissionTexture": "Only the factor counts."}

    transmission_factor: Share = 0.0


class Refraction(Part):
    """`KHR_materials_ior`."""

    ior: RefractiveIndex = 1.5


class MaterialExtensions(Part):
    """Extensions of a material."""

    transmission: Transmission | None = Field(default=None, alias="KHR_materials_transmission")
    refraction: Refraction = Field(default=Refraction(), alias="KHR_materials_ior")


class Material(Part):
    """Material of a surface."""

    # All surfaces of a scene are seen from both sides; the cutoff belongs to the mode, which is noted.
    SILENT: ClassVar[frozenset[str]] = _NAMES | {"doubleSided", "alphaCutoff"}
    REASONS: ClassVar[dict[str, str]] = {
        "emissiveFactor": "Shapes emit no light: put a light in their place.",
        "emissiveTexture": "Shapes emit no light: put a light in their place.",
        "occlusionTexture": "Occlusion is left out: real shadows are cast instead.",
    }

    name: Text | None = None
    pbr: Roughness = Field(default=Roughness(), alias="pbrMetallicRoughness")
    normal_texture: TextureUse | None = None
    alpha_mode: Text = "OPAQUE"
    extensions: MaterialExtensions = MaterialExtensions()


class Image(Part):
    """A picture, in a file or in a buffer."""

    name: Text | None = None
    uri: Text | None = None
    mime_type: Text | None = None
    buffer_view: Index | None = None


class Sampler(Part):
    """Wrap modes of a picture."""

    SILENT: ClassVar[frozenset[str]] = _NAMES | {"minFilter"}

    mag_filter: Index | None = None
    wrap_s: Index = 10497
    wrap_t: Index = 10497


class Texture(Part):
    """A picture and how it is repeated."""

    source: Index | None = None
    sampler: Index | None = None


class Perspective(Part):
    """The view of a camera."""

    SILENT: ClassVar[frozenset[str]] = _NAMES | {"znear", "zfar"}

    yfov: Angle
    aspect_ratio: Ratio | None = None


class Camera(Part):
    """A camera, which looks along -z of its node."""

    REASONS: ClassVar[dict[str, str]] = {"orthographic": "Orthographic views are left out."}

    type: Text
    perspective: Perspective | None = None


class Cone(Part):
    """The cone of a spot light; its angles count from the axis."""

    inner_cone_angle: HalfAngle = 0.0
    outer_cone_angle: HalfAngle = math.pi / 4


class PunctualLight(Part):
    """A light of `KHR_lights_punctual`: in candela for points, in lux for directions."""

    REASONS: ClassVar[dict[str, str]] = {"range": "The range of lights is left out: they reach any distance."}

    type: Literal["point", "directional", "spot"]
    color: Color = (1.0, 1.0, 1.0)
    intensity: Intensity = 1.0
    spot: Cone = Cone()


class PunctualLights(Part):
    """All lights."""

    lights: tuple[PunctualLight, ...]


class DocumentExtensions(Part):
    """Extensions of the document."""

    lights: PunctualLights | None = Field(default=None, alias="KHR_lights_punctual")


class About(Part):
    """`asset`: which version of glTF this is."""

    SILENT: ClassVar[frozenset[str]] = _NAMES | {"generator", "copyright", "minVersion"}

    version: Text


class Document(Part):
    """The whole document."""

    SILENT: ClassVar[frozenset[str]] = _NAMES | {"extensionsUsed"}
    REASONS: ClassVar[dict[str, str]] = {
        "animations": "Animations are left out.",
        "skins": "Skins are left out: meshes keep their base shape.",
    }

    asset: About
    extensions_required: tuple[Text, ...] = ()
    scene: Index | None = None
    scenes: tuple[SceneNodes, ...] = ()
    nodes: tuple[Node, ...] = ()
    meshes: tuple[Mesh, ...] = ()
    accessors: tuple[Accessor, ...] = ()
    buffer_views: tuple[BufferView, ...] = ()
    buffers: tuple[Buffer, ...] = ()
    materials: tuple[Material, ...] = ()
    textures: tuple[Texture, ...] = ()
    samplers: tuple[Sampler, ...] = ()
    images: tuple[Image, ...] = ()
    cameras: tuple[Camera, ...] = ()
    extensions: DocumentExtensions = DocumentExtensions()


def pick(name: str, items: Sequence[Item], number: int, pointer: str) -> Item:
    """One item of a list; ConversionError at the place that names one too many."""
    if number >= len(items):
        raise wrong_at(name, pointer, f"There is no number {number}: the document has {len(items)} of them.")
    return items[number]
