"""The plan of a picture: what runs, in which order, and which part of the scene requested it."""

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from renderer.cameras import Pinhole, Window
from renderer.interaction import RayStage
from renderer.layers import Layer
from renderer.lights.surfaces import LightSurfaces, Unshaded
from renderer.math.arrays import Floats, Integers, Masks
from renderer.plan.geometry import SceneGeometry
from renderer.plan.stages import Entry, Illumination, PointStage, ScatteringStage
from renderer.scenes import LoadedScene
from schemas.api.plans import LeftOut, PlanCost, PlanDocument, PlanStage
from schemas.errors import Problem
from schemas.quality import Antialiasing, Quality
from schemas.scene import Scene
from schemas.tiles import Pass


class Policy(Protocol):
    """How a picture of target quality begins, and what each pass of it asks for."""

    def first_stride(self, width: int, height: int) -> int:
        """Pixels between the nodes of the first lattice."""
        ...

    def first_level(self, error: float) -> int:
        """What the first pass wants of a node, where an error is aimed at."""
        ...

    def advance(self, estimate: Any) -> bool:
        """Decide what the next pass of an estimate wants; False if the picture is done."""
        ...


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RenderPlan:
    """All that rendering a scene needs; made by `compile_scene`, never changed.

    Attributes
    ----------
    scene : LoadedScene
    geometry : SceneGeometry
        What is built of it whatever the quality.
    quality : Quality or None
        What took the place of the scene's own sampling.
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
        What is recorded about each pixel beside its colour.
    culling : bool
        Whether conservative tests leave out work; images are the same without them.
    numerics : dict
        `degenerate_dropped`: triangles without area, which are left out. `retried`: triangles so thin that
        exact arithmetic had to decide if they have one.
    entries, left_out
        The plan as people read it.
    adaptive : AdaptivePlan or None
        What target quality needs in addition; None for fixed quality.
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
    adaptive: "AdaptivePlan | None" = None

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

    def describe(self) -> PlanDocument:
        """The plan as a document: stages and what requested them, what was left out, predicted cost."""
        pilot = self.adaptive.pilot if self.adaptive else None
        total = sum(entry.seconds for entry in self.entries)
        rays = self.width * self.height * self.antialiasing.samples
        shadow = sum(lighting.emitter.count for lighting in self.lightings if lighting.casts)
        return PlanDocument(
            stages=tuple(_stage(entry, total) for entry in self.entries),
            pilot_samples=tuple(_stage(entry, 0.0) for entry in pilot.entries) if pilot else (),
            left_out=self.left_out,
            cost=PlanCost(camera_rays=rays, shadow_rays=rays * shadow, cpu_seconds=total),
        )


@dataclass(frozen=True, slots=True, eq=False)
class AdaptivePlan:
    """What target quality needs of a scene besides the plan of its samples.

    Attributes
    ----------
    policy : Policy
        How the picture begins and continues.
    pilot : RenderPlan or None
        What runs for the pilot sample at the middle of each pixel; None through a lens, where pixels are
        sampled at once. Its entries list only what differs from samples.
    averaged : (shapes,) bool
        Shapes whose textures pilot samples average over the pixel.
    detailed : (shapes,) bool
        Those of them whose texels pilot samples shade apart from light.
    textured, needs_sampling : (shapes,) bool
        Shapes that take their colour from a texture, and shapes with something else on them that may be finer
        than pixels: bent normals, mirrors, glass.
    glints : (shapes,) float64
        Brightness of the brightest visible light as each shape reflects or transmits it, 0 where it is not
        above white.
    thin : (2, N) int64
        Columns and rows of pixels along shapes that are thin on the picture; through a lens, of all
        that these may touch.
    narrow : (2, N) int64
        The same along parts of round shapes that are a few pixels wide: their shading turns within a pixel.
        This and the following are empty through a lens.
    edges : (2, N) int64
        The same of pixels that edges of flat shapes pass.
    lamps : (2, N) int64
        Those of them that edges of visible lights pass.
    shadow_edges : (3, N) int64
        The same of pixels that edges of hard shadows may pass, and the shape that each of them falls on.
    """

    policy: Policy
    pilot: RenderPlan | None
    textured: Masks
    averaged: Masks
    detailed: Masks
    needs_sampling: Masks
    glints: Floats
    thin: Integers
    narrow: Integers
    edges: Integers
    lamps: Integers
    shadow_edges: Integers

    @property
    def tinted(self) -> Masks:
        """Shapes (K,) whose colour is a texture with a known mean, and nothing else on them varies."""
        return self.averaged & ~self.detailed

    @property
    def fine(self) -> Masks:
        """Shapes (K,) on which something may be finer than pixels."""
        return self.needs_sampling | self.textured

    @property
    def unaveraged(self) -> Masks:
        """Those of them (K,) of which a pilot sample does not give the mean over its pixel."""
        return self.needs_sampling | self.textured & ~self.averaged


def seen_by(plan: RenderPlan, camera: Window) -> RenderPlan:
    """The plan of the part of its picture that a window shows; passes are still those of the whole."""
    adaptive = plan.adaptive
    if adaptive is not None:
        adaptive = replace(
            adaptive,
            pilot=adaptive.pilot and seen_by(adaptive.pilot, camera),
            thin=camera.places(adaptive.thin),
            narrow=camera.places(adaptive.narrow),
            edges=camera.places(adaptive.edges),
            lamps=camera.places(adaptive.lamps),
            shadow_edges=camera.places(adaptive.shadow_edges),
        )
    return replace(plan, camera=camera, adaptive=adaptive)


def adaptive_part(plan: RenderPlan) -> AdaptivePlan:
    """What target quality needs, of a plan that was made for it."""
    assert plan.adaptive is not None
    return plan.adaptive


def pilot_of(plan: RenderPlan) -> RenderPlan:
    """What runs for the pilot samples of a plan for target quality: through a lens, what runs for samples."""
    return adaptive_part(plan).pilot or plan


def _stage(entry: Entry, total: float) -> PlanStage:
    """A line of the plan, with its share of the predicted seconds if there are any."""
    return PlanStage(
        name=entry.name,
        effect=entry.effect,
        pointers=entry.pointers,
        detail=entry.detail,
        share=entry.seconds / total if total else None,
    )
