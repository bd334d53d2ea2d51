"""Pictures as a program would have made them without mistakes that it makes everywhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import renderer
from accuracy.comparison import Comparison, Picture, variances
from accuracy.comparison.blocks import BLOCK_SIDE
from accuracy.comparison.blurs import smoothed
from accuracy.comparison.diagnosis import BLURRED, FILTERED, JAGGED, LOSSY, PREDICTED, effect_of
from accuracy.comparison.mistakes import EXPOSURE, Undo, candidates, exposure_of
from accuracy.comparison.neighbours import neighbourhood
from accuracy.comparison.noise import sample_variances
from renderer.math.arrays import Floats
from renderer.scenes import LoadedScene
from schemas.grading.acceptance import Acceptance, Verdict
from schemas.quality import Antialiasing, LightSampling
from service.grading.accepting import noiseless
from service.grading.displacements import DisplacedPinhole, Displacement
from service.grading.mistakes.reproductions import kept, quality_of
from service.grading.programs.program import MISTAKES, Program, ProgramMistake, ProgramMistakes, is_undone
from service.grading.references import Wanted

SAMPLES = 64
"""Camera samples of a reference that is rendered with an offset: at edges its error is 0.01."""

LIGHT_POINTS = 4
"""Points of a light for each of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Repair:
    """Repair of a program's picture of one reference: some of its mistakes undone.

    Attributes
    ----------
    program : Program
        With the mistakes to undo but missing anti-aliasing, which `jagged` says.
    ambient : (H, W, 3) float64 or None
        The ambient term that is missing; None where none is.
    moved : (H, W, 3) float64 or None
        The reference with the program's offset; None where it has none.
    """

    reference: Wanted
    program: Program
    jagged: bool
    ambient: Floats | None
    moved: Floats | None

    @classmethod
    def of(
        cls,
        reference: Wanted,
        mistakes: ProgramMistakes,
        undone: Sequence[ProgramMistake],
        keep: Path | None = None,
    ) -> Repair:
        """Undo the mistakes `undone`; the folder `keep` has rendered pictures that submissions share."""
        program, ambient, moved = mistakes.made(undone), None, None
        if program.lightless and reference.scene is not None:
            ambient = ambient_term(reference.scene, SAMPLES, program.offset, keep)
        if program.offset is not None:
            moved = _displaced(reference, program.offset, keep)
        return cls(reference, program, any(each.kind == "antialiasing" for each in undone), ambient, moved)

    def pair(self, picture: Picture) -> tuple[Picture, Picture]:
        """A picture without the mistakes, and what to compare it with."""
        # Undoing a mistake changes the noise.
        linear, rounding = self.linear(picture.linear), _rounding(picture, self.program)
        right = noiseless(picture).with_values(linear, rounding)
        expected = self.reference.picture
        return right, expected if self.moved is None else _with_noise_around(expected)

    def linear(self, image: Floats) -> Floats:
        """The values (H, W, 3) of a picture without the mistakes."""
        wanted = self.reference.picture.linear
        linear = self.program.undone(image, wanted, self.ambient)
        if self.moved is not None:
            # What an offset changes does not depend on the picture: its noise stays as it is.
            linear = np.clip(linear + wanted - self.moved, 0, 1)
        return without_jags(linear, wanted) if self.jagged else linear


@dataclass(frozen=True, slots=True)
class Pardon:
    """A mistake of a single picture that costs no points in its test.

    Attributes
    ----------
    cause : str
        Empty where nothing is forgiven.
    undo : callable
        Values (H, W, 3) to those without the mistake.
    noise : (H, W, 3) float64 or 0
        Variance that undoing leaves beside the noise of samples: as that of one more sample.
    """

    cause: str
    undo: Undo
    noise: Floats | float = 0.0

    def sentence(self, *, passed: bool) -> str:
        """Sentence for the student whose picture passed so or not; empty where nothing is forgiven."""
        if not self.cause:
            return ""
        restored = passed or self.cause != LOSSY
        price = "that mistake costs no points here" if restored else "what JPEG loses is never fully restored"
        return f"It is judged as if {self.cause} were fixed; {price}."

    @property
    def is_noisy(self) -> bool:
        """Whether it puts noise into the pixels around."""
        return self.cause in {BLURRED, FILTERED, LOSSY}

    def reference(self, picture: Picture) -> Picture:
        """A reference that allows for the noise that the mistake brings from the pixels around."""
        return _with_noise_around(picture, self.noise) if self.is_noisy else picture

    def picture(self, picture: Picture) -> Picture:
        """A picture without the mistake."""
        if not self.cause:
            return picture
        linear = self.undo(picture.linear)
        rounding = np.abs(self.undo(np.minimum(picture.linear + picture.rounding, 1)) - linear)
        # Undoing a mistake changes the noise.
        return noiseless(picture).with_values(linear, np.maximum(rounding, picture.rounding))


def pardoned(accept: Acceptance, found: Comparison) -> Pardon:
    """The first mistake in the diagnosis of a whole picture that its test forgives."""
    forgiven = accept.forgiven if isinstance(accept, Verdict) else ()
    # What changes no more than a blur is accepted wherever a blur is.
    forgiven = (*forgiven, *PREDICTED) if BLURRED in forgiven else forgiven
    cause = next((each.cause for each in found.causes if each.is_undone and each.cause in forgiven), "")
    if not cause:
        return Pardon("", _unchanged)
    image, reference = found.image, found.reference
    if cause in PREDICTED and (effect := effect_of(cause, image, reference)) is not None:
        # JPEG rounds a noisy picture otherwise than its reference, by about as much as in the blocks around.
        around = smoothed(effect * effect, BLOCK_SIDE / 2) if cause == LOSSY else 0.0
        noise = around * (found.policy.samples or 1)
        return Pardon(cause, lambda values: np.clip(values - effect, 0, 1), noise)
    if cause in {JAGGED, BLURRED}:
        return Pardon(cause, partial(without_jags, reference=reference.linear))
    if cause == EXPOSURE and not is_undone(exposure_of(image, reference) or 1.0):
        return Pardon("", _unchanged)
    undo = next((each.undo for each in candidates(image, reference) if each.cause == cause), _unchanged)
    return Pardon(cause, undo)


def _unchanged(values: Floats) -> Floats:
    return values


def _with_noise_around(reference: Picture, more: Floats | float = 0.0) -> Picture:
    """A reference with the noise of the noisiest neighbour: an offset puts noise up to a pixel elsewhere.

    `more` is added to the variance of a sample.
    """
    if not variances.known(reference):
        return reference
    single = sample_variances(reference)
    samples = reference.layers["samples"].astype(np.float64)[:, :, None]
    error = np.sqrt((neighbourhood(single)[1] + more) / samples)
    return replace(reference, layers={**reference.layers, "error": error})


def without_jags(image: Floats, reference: Floats) -> Floats:
    """A picture without anti-aliasing as if it had some, (H, W, 3).

    The mistake cannot be undone. Pixels may take values within their neighbourhood; only the excess counts.
    """
    return np.asarray(reference + image - np.clip(image, *neighbourhood(reference)))


def ambient_term(
    scene: LoadedScene, samples: int, offset: Displacement | None = None, keep: Path | None = None
) -> Floats | None:
    """The part of a picture that is its ambient term, linear (H, W, 3); None where there is none."""
    document = scene.document
    materials = [document.materials[name] for name in {shape.material for shape in document.shapes}]
    lit = any(each.ambient > 0 and (each.color_texture or any(each.color or ())) for each in materials)
    if not lit or not any(document.ambient):
        return None
    dark = document.model_copy(update={"lights": (), "background": (0.0, 0.0, 0.0)})
    return _rendered(LoadedScene(dark, scene.assets), samples, offset, keep)


def _displaced(reference: Wanted, offset: Displacement, keep: Path | None) -> Floats:
    """The reference with an offset: rendered where its scene is known and its camera has no lens."""
    scene = reference.scene
    if scene is None or scene.document.camera.lens_radius > 0:
        return offset.of(reference.picture.linear)
    return np.clip(_rendered(scene, SAMPLES, offset, keep), 0, 1)


def _rendered(scene: LoadedScene, samples: int, offset: Displacement | None, keep: Path | None) -> Floats:
    key = f"offset {offset} {samples} {scene.document.model_dump_json()}"
    return kept(keep, key, partial(_image, scene, samples, offset)).astype(np.float64)


def _image(scene: LoadedScene, samples: int, offset: Displacement | None) -> NDArray[np.float32]:
    pixels = Antialiasing(pattern="sobol" if samples > 1 else "center", samples=samples)
    lights = LightSampling(pattern="sobol", samples=LIGHT_POINTS)
    plan = renderer.compile_scene(scene, quality_of(scene, pixels, lights))
    if offset is not None:
        plan = replace(plan, camera=DisplacedPinhole.of(offset, plan.width, plan.height, plan.camera))
    return renderer.render(plan).image


def _rounding(picture: Picture, program: Program) -> Floats:
    """By how much rounding may have moved the values of a repaired picture."""
    rounding = program.facing(picture.rounding)
    if program.encoding is not None:
        undo, linear = MISTAKES[program.encoding].undo, program.facing(picture.linear)
        rounding = np.abs(undo(linear + rounding) - undo(linear))
    return rounding / program.scale
