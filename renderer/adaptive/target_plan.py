"""The plan of a picture of target quality: the plan of its samples, with pilot samples and hints."""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

from renderer.cameras import Window
from renderer.math.arrays import Floats, Integers, Masks
from renderer.plan.plan import RenderPlan, stage_document
from schemas.api.plans import PlanDocument
from schemas.quality import TargetQuality


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TargetPlan(RenderPlan):
    """The plan of samples with that of pilot samples, and hints from the scene.

    Attributes
    ----------
    pilot : RenderPlan or None
        Plan of the pilot sample at the centre of each pixel; None through a lens, where pixels are sampled at
        once. Its entries list only the differences from samples.
    averaged : (shapes,) bool
        Shapes whose textures pilot samples average over the pixel.
    detailed : (shapes,) bool
        Those of them with decoupled shading (`fine_texture`).
    textured, needs_sampling : (shapes,) bool
        Shapes with a colour texture, and shapes with other detail that may be finer than pixels: normal and
        bump maps, mirrors, glass.
    glints : (shapes,) float64
        Brightness of the brightest visible light as each shape reflects or transmits it, 0 where it is not
        above white.
    thin : (2, N) int64
        Columns and rows of pixels along shapes that are thin on the picture; through a lens, all that these
        may touch.
    edges : (2, N) int64
        Pixels crossed by edges of flat shapes. This and the following are empty through a lens.
    lamps : (2, N) int64
        Pixels crossed by edges of visible lights.
    thin_shadows : (3, N) int64
        Columns and rows of pixels that thin shadows may cross, and the shape that each of them falls on.
    """

    quality: TargetQuality
    pilot: RenderPlan | None
    textured: Masks
    averaged: Masks
    detailed: Masks
    needs_sampling: Masks
    glints: Floats
    thin: Integers
    edges: Integers
    lamps: Integers
    thin_shadows: Integers

    @property
    def records_centres(self) -> bool:
        """Whether the first pass records layers at the centres of pixels."""
        return any(layer.values for layer in self.layers)

    @property
    def tinted(self) -> Masks:
        """Shapes (K,) whose only fine detail is a colour texture with a known mean."""
        return self.averaged & ~self.detailed

    @property
    def fine(self) -> Masks:
        """Shapes (K,) with detail that may be finer than pixels."""
        return self.needs_sampling | self.textured

    @property
    def unaveraged(self) -> Masks:
        """Shapes (K,) whose pilot sample is a point sample, not the mean over its pixel."""
        return self.needs_sampling | self.textured & ~self.averaged

    @classmethod
    def of(cls, plan: RenderPlan, **more: Any) -> Self:
        """A plan of samples with the fields of this class."""
        return cls(**{item.name: getattr(plan, item.name) for item in fields(RenderPlan)} | more)

    def seen_by(self, camera: Window) -> Self:
        """The plan of a part of the picture."""
        names = "thin", "edges", "lamps", "thin_shadows"
        moved: dict[str, Any] = {name: camera.places(getattr(self, name)) for name in names}
        return replace(self, camera=camera, pilot=self.pilot and self.pilot.seen_by(camera), **moved)

    def describe(self) -> PlanDocument:
        """The plan as a document, with the stages of pilot samples."""
        pilots = self.pilot.entries if self.pilot else ()
        stages = tuple(stage_document(entry, 0.0) for entry in pilots)
        return RenderPlan.describe(self).model_copy(update={"pilot_samples": stages})


def target_plan(plan: RenderPlan) -> TargetPlan:
    """Narrow the type of a plan that was compiled for target quality."""
    assert isinstance(plan, TargetPlan)
    return plan
