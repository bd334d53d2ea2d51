"""The plan of a picture of target quality: that of its samples, and what is known of it beforehand."""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

from renderer.cameras import Window
from renderer.math.arrays import Floats, Integers, Masks
from renderer.plan.plan import RenderPlan, stage_document
from schemas.api.plans import PlanDocument


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TargetPlan(RenderPlan):
    """What target quality needs of a scene besides the plan of its samples.

    Attributes
    ----------
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
    edges : (2, N) int64
        The same of pixels that edges of flat shapes pass. This and the following are empty through a lens.
    lamps : (2, N) int64
        Those of them that edges of visible lights pass.
    thin_shadows : (3, N) int64
        The same of pixels that thin shadows may pass, and the shape that each of them falls on.
    """

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

    @classmethod
    def of(cls, plan: RenderPlan, **more: Any) -> Self:
        """A plan of samples with more."""
        return cls(**{item.name: getattr(plan, item.name) for item in fields(RenderPlan)} | more)

    def seen_by(self, camera: Window) -> Self:
        """The plan of the part of its picture that another camera shows."""
        names = "thin", "edges", "lamps", "thin_shadows"
        moved: dict[str, Any] = {name: camera.places(getattr(self, name)) for name in names}
        return replace(self, camera=camera, pilot=self.pilot and self.pilot.seen_by(camera), **moved)

    def describe(self) -> PlanDocument:
        """The plan as a document, with what pilot samples do in another way."""
        pilots = self.pilot.entries if self.pilot else ()
        stages = tuple(stage_document(entry, 0.0) for entry in pilots)
        return RenderPlan.describe(self).model_copy(update={"pilot_samples": stages})


def target_plan(plan: RenderPlan) -> TargetPlan:
    """A plan that was made for target quality, as such."""
    assert isinstance(plan, TargetPlan)
    return plan
