"""Geometry and textures of a scene, which plans of any sampling share."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from renderer.accelerators.coincidence import overlaps_of
from renderer.assets import AssetError, AssetSource
from renderer.cameras import build_pinhole
from renderer.errors import SceneError
from renderer.plan.effects import SHAPES, TEXTURES, ShapeEffect
from renderer.plan.strengths import effective
from renderer.scenes import LoadedScene
from renderer.shapes import Family, displacement
from renderer.shapes.displacement import Displaced
from renderer.shapes.overlaps import Overlaps
from renderer.shapes.triangles import Triangles, on_lines
from renderer.textures import Texture
from renderer.textures.heights import Heights, image_of
from renderer.textures.image import ImageTexture
from renderer.textures.mipmap import MipmapTexture
from schemas.api.plans import LeftOut
from schemas.errors import Problem
from schemas.materials import shown_textures
from schemas.pointers import escaped
from schemas.reading.advice import no_coordinates
from schemas.scene import Scene
from schemas.shapes import MeshFile, Triangle
from schemas.textures import Texture as Written


class Textures:
    """The textures that have been built from a scene's files, by what the scene says of them."""

    def __init__(self, assets: AssetSource) -> None:
        self._assets = assets
        self._built: dict[Written, Texture] = {}
        self._warnings: dict[Problem, None] = {}

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """Warnings about the files of textures: unused alpha, chosen parts."""
        return tuple(self._warnings)

    def named(self, document: Scene, name: str, *, stored: bool) -> Texture:
        """A texture of a scene; `stored` for data, which is read as the file holds it.

        Raises
        ------
        SceneError
            If its file is missing or no picture.
        """
        written = document.textures[name]
        if stored:
            written = written.model_copy(update={"encoding": "linear"})
        pointer = f"/textures/{escaped(name)}/asset"
        try:
            texture = self._of(written)
            notes = self._notes(texture, stored=stored)
        except AssetError as error:
            raise SceneError((Problem(pointer=pointer, detail=str(error), code="asset"),)) from error
        for note in notes:
            self._warnings[Problem(pointer=pointer, detail=note, code="asset")] = None
        return texture

    def _notes(self, texture: Texture, *, stored: bool) -> tuple[str, ...]:
        """Warnings about a texture; AssetError if its numbers are not colours."""
        if not isinstance(texture, ImageTexture | MipmapTexture):
            return ()
        base = image_of(texture)
        if not stored and base.bounds[0] < 0:
            raise AssetError(
                f"This picture has values below 0, down to {base.bounds[0]:.6g}, and a colour has none. "
                "Save it without them."
            )
        return base.notes

    def _of(self, written: Written) -> Texture:
        """Two threads may build the same texture; both get the same one in the end."""
        if written not in self._built:
            self._built.setdefault(written, TEXTURES[type(written)].build(written, self._assets))
        return self._built[written]

    def heights(self, document: Scene, name: str, scale: float) -> Heights:
        """A texture of a scene as heights; raises as `named` does."""
        effect = TEXTURES[type(document.textures[name])]
        assert effect.heights is not None, "the scene language takes heights of images alone"
        return Heights(effect.heights(self.named(document, name, stored=True)), scale)


@dataclass(frozen=True, slots=True, eq=False)
class SceneGeometry:
    """Shapes and textures of a scene, ready for any plan of it.

    Trees over its triangles belong to the families (`accelerators.trees`), and are built once for them.

    Attributes
    ----------
    families : tuple of Family
        In the order in which kinds first appear, displaced shapes last. What has no area is not among them.
    textures : Textures
        Each built when a plan first asks for it.
    displaced : tuple of str
        Pointers to the displacement maps that moved shapes.
    left_out : tuple of LeftOut
        Shapes that nothing is built of.
    warnings : tuple of Problem
        Warnings about the files of shapes.
    overlaps : Overlaps or None
        Ties between surfaces in one place.
    degenerate, retried : int
        Triangles without area, and triangles so thin that exact arithmetic had to decide if they have one.
    """

    families: tuple[Family, ...]
    textures: Textures
    displaced: tuple[str, ...]
    left_out: tuple[LeftOut, ...]
    warnings: tuple[Problem, ...]
    overlaps: Overlaps | None
    degenerate: int
    retried: int


def build_geometry(scene: LoadedScene) -> SceneGeometry:
    """Build the shapes of a scene.

    Raises
    ------
    SceneError
        If a file that a shape, or its displacement map, names is missing or cannot be used.
    """
    making = _Making(effective(scene.document), scene.assets, Textures(scene.assets))
    built = [*making.still(), *making.moved()]
    making.retried += sum(family.count_retried() for family in built)
    families = tuple(part for family in built if (part := making.with_area(family)) is not None)
    lacking = sum(int(np.count_nonzero(family.without_area())) for family in families)
    return SceneGeometry(
        families=families,
        textures=making.textures,
        displaced=tuple(making.displaced),
        left_out=tuple(making.left_out),
        warnings=tuple(_without_coordinates(making.document, families)),
        overlaps=overlaps_of(families, len(scene.document.shapes)),
        degenerate=making.degenerate + lacking,
        retried=making.retried,
    )


def shown_materials(document: Scene) -> list[str]:
    """Names of the materials that some shape shows, in the order of the scene."""
    shown = {shape.material for shape in document.shapes}
    return [name for name in document.materials if name in shown]


@dataclass(slots=True)
class _Making:
    """The geometry under construction."""

    document: Scene
    assets: AssetSource
    textures: Textures
    displaced: list[str] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    degenerate: int = 0
    retried: int = 0

    def _leave_out(self, effect: str, reason: str, pointer: str) -> None:
        self.left_out.append(LeftOut(effect=effect, pointers=(pointer,), reason=reason))

    def still(self) -> list[Family]:
        """Families of the shapes whose surface stays where it is."""
        members: dict[ShapeEffect, list[int]] = {}
        lines = self._lines()
        for number, shape in enumerate(self.document.shapes):
            if number in lines:
                self.degenerate += 1
                self.retried += 1
                self._leave_out("shapes.triangle", "its three vertices lie on one line", f"/shapes/{number}")
            elif self.document.materials[shape.material].displacement_map is None:
                members.setdefault(SHAPES[type(shape)], []).append(number)
        return [self._family(effect, numbers) for effect, numbers in members.items()]

    def _lines(self) -> set[int]:
        """Numbers of the triangles whose vertices lie on one line."""
        shapes = self.document.shapes
        numbers = [number for number, shape in enumerate(shapes) if isinstance(shape, Triangle)]
        flat = on_lines([shape for shape in shapes if isinstance(shape, Triangle)])
        return {numbers[place] for place in np.flatnonzero(flat).tolist()}

    def _family(self, effect: ShapeEffect, numbers: list[int]) -> Family:
        shapes = [self.document.shapes[number] for number in numbers]
        try:
            return effect.build(numbers, shapes, self.assets)
        except AssetError as error:
            raise _unusable(error) from error

    def moved(self) -> list[Family]:
        """The family of the shapes whose surface is moved."""
        parts: list[Displaced] = []
        read: dict[tuple[str, float], Heights] = {}
        for number, shape in enumerate(self.document.shapes):
            material = self.document.materials[shape.material]
            if material.displacement_map is None:
                continue
            key = (material.displacement_map, material.displacement_height)
            if key not in read:
                read[key] = self.textures.heights(self.document, *key)
            parts.append(Displaced(number, shape, read[key]))
            self.displaced.append(f"/materials/{escaped(shape.material)}/displacement_map")
        self.displaced = list(dict.fromkeys(self.displaced))
        if not parts:
            return []
        try:
            return [displacement.build(parts, build_pinhole(self.document.camera), self.assets)]
        except AssetError as error:
            raise _unusable(error) from error

    def with_area(self, family: Family) -> Family | None:
        """The family without the shapes of which no triangle has an area; None if there are no others."""
        seen = np.isin(family.numbers, family.numbers[~family.without_area()])
        for number in np.unique(family.numbers[~seen]).tolist():
            reason = "no triangle of it has an area"
            self._leave_out(f"shapes.{family.kind}", reason, f"/shapes/{number}")
        self.degenerate += int(np.count_nonzero(~seen))
        if seen.all():
            return family
        return family.part(seen) if seen.any() else None


def _without_coordinates(document: Scene, families: Iterable[Family]) -> Iterator[Problem]:
    """Warnings of textured files without texture coordinates, one a material; the scene's own are known."""
    bare: dict[str, list[int]] = {}
    for family in families:
        numbers = family.numbers[~family.mapped] if isinstance(family, Triangles) else family.numbers[:0]
        for number in np.unique(numbers).tolist():
            if isinstance(document.shapes[number], MeshFile):
                bare.setdefault(document.shapes[number].material, []).append(number)
    for name, shapes in bare.items():
        if parts := shown_textures(document.materials[name]):
            detail = no_coordinates("mesh", parts[0], len(shapes) - 1)
            pointer = f"/shapes/{shapes[0]}/asset"
            yield Problem(pointer=pointer, detail=detail, code="no_texture_coordinates")


def _unusable(error: AssetError) -> SceneError:
    return SceneError((Problem(pointer=error.pointer, detail=str(error), code="asset"),))
