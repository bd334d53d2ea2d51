"""The plan of a picture: what runs, in which order, and which part of the scene requested it."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from renderer.cameras import Pinhole, Window
from renderer.interaction import RayStage
from renderer.layers import Layer
from renderer.lights.surfaces import LightSurfaces, Unshaded
from renderer.math.arrays import Integers
from renderer.plan.geometry import SceneGeometry
from renderer.plan.stages import Entry, Illumination, PointStage, ScatteringStage
from renderer.scenes import LoadedScene
from schemas.api.plans import LeftOut, PlanCost, PlanDocument, PlanStage
from schemas.errors import Problem
from schemas.quality import Antialiasing, Quality
from schemas.scene import Scene
from schemas.tiles import Pass


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RenderPlan:
    """Immutable plan of a picture, made by `compile_scene`.

    Attributes
    ----------
    scene : LoadedScene
    geometry : SceneGeometry
        Geometry, which is built once for any quality.
    quality : Quality or None
        The quality in place of the scene's own sampling.
    camera : Pinhole
    antialiasing : Antialiasing
    seed : int
    passes : tuple of Pass
        The first is a coarse preview; the others share out the camera samples.
    intersectors, visible_lights : tuples of stages
        For rays: hits with shapes, and lights that the camera sees.
    surfaces, lightings : tuples of stages
        For points, and for points and one light.
    scattering : tuple of stages
        Send new rays from points.
    unshaded : Unshaded
    materials : (shapes,) int64
        Material of each shape.
    bent : bool
        Whether some stage bends shading normals.
    dtype : float32 or float64
        Of pair work.
    layers : tuple of Layer
        Values recorded of each pixel beside its colour.
    culling : bool
        Whether conservative tests leave out work; images are the same without them.
    numerics : dict
        `degenerate_dropped`: triangles without area, and copies, which are left out. `retried`: triangles so
        thin that exact arithmetic had to decide if they have one.
    entries, left_out
        The plan as people read it.
    """

    scene: LoadedScene
    geometry: SceneGeometry
    quality: Quality | None
    camera: Pinhole
    antialiasing: Antialiasing
    seed: int
    passes: tuple[Pass, ...]
    intersectors: tuple[RayStage, ...]
    visible_lights: tuple[LightSurfaces, ...]
    surfaces: tuple[PointStage, ...]
    lightings: tuple[Illumination, ...]
    scattering: tuple[ScatteringStage, ...]
    unshaded: Unshaded
    materials: Integers
    bent: bool
    dtype: np.dtype[np.floating]
    layers: tuple[Layer, ...]
    culling: bool
    numerics: dict[str, int]
    entries: tuple[Entry, ...]
    left_out: tuple[LeftOut, ...]

    def __repr__(self) -> str:
        """Scene, size and numbers of stages in one line: written out, a plan fills a megabyte."""
        stages = len(self.intersectors) + len(self.surfaces) + len(self.lightings) + len(self.scattering)
        return (
            f"<RenderPlan {self.document.name or 'scene'!r}, {self.width} x {self.height}, {stages} stages>"
        )

    @property
    def document(self) -> Scene:
        """The scene as written."""
        return self.scene.document

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """Warnings about the scene and about the files of its shapes and textures."""
        return (*self.scene.warnings, *self.geometry.textures.warnings, *self.geometry.warnings)

    @property
    def width(self) -> int:
        """Pixels."""
        return self.camera.width

    @property
    def height(self) -> int:
        """Pixels."""
        return self.camera.height

    @property
    def light_points(self) -> int:
        """Largest number of light points of any light, at least 1."""
        return max((lighting.emitter.count for lighting in self.lightings), default=1)

    def layers_in(self, pass_: Pass) -> tuple[Layer, ...]:
        """Layers that a pass records: all where the camera samples begin, later what is formed from them."""
        return tuple(layer for layer in self.layers if layer.recorded_in(pass_))

    def seen_by(self, camera: Window) -> Self:
        """The plan of the part of its picture that a window shows; passes are still those of the whole."""
        return replace(self, camera=camera)

    def describe(self) -> PlanDocument:
        """The plan as a document: stages and what requested them, what was left out, predicted cost."""
        total = sum(entry.seconds for entry in self.entries)
        rays = self.width * self.height * self.antialiasing.samples
        shadow = sum(lighting.emitter.count for lighting in self.lightings if lighting.casts)
        return PlanDocument(
            stages=tuple(stage_document(entry, total) for entry in self.entries),
            left_out=self.left_out,
            cost=PlanCost(camera_rays=rays, shadow_rays=rays * shadow, cpu_seconds=total),
        )


def stage_document(entry: Entry, total: float) -> PlanStage:
    """A line of the plan, with its share of the predicted seconds if there are any."""
    return PlanStage(
        name=entry.name,
        effect=entry.effect,
        pointers=entry.pointers,
        detail=entry.detail,
        share=entry.seconds / total if total else None,
    )
