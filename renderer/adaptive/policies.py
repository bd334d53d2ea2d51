"""How pictures of target quality begin and continue: with pilot samples, or on a lattice of samples.

Plan building chooses; no other code depends on which of them a picture follows.
"""

from dataclasses import dataclass

from renderer.adaptive import blur, blur_decisions, decisions
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.lattice import stride_for
from renderer.adaptive.levels import PREVIEWED


@dataclass(frozen=True, slots=True)
class PilotSamples:
    """One ray through the middle of pixels, with little noise, and samples where that does not do."""

    def first_stride(self, width: int, height: int) -> int:
        """Pixels between the nodes of the first lattice."""
        return stride_for(width, height)

    def first_level(self, error: float) -> int:
        """What the first pass wants of a node."""
        del error
        return PREVIEWED

    def advance(self, estimate: Estimate) -> bool:
        """Decide what the next pass wants; False if the picture is done."""
        return decisions.advance(estimate)


@dataclass(frozen=True, slots=True)
class SampledLattice:
    """Samples of nodes of a lattice, and values in between where the picture is out of focus."""

    def first_stride(self, width: int, height: int) -> int:
        """Pixels between the nodes of the first lattice."""
        return blur.first_stride(width, height)

    def first_level(self, error: float) -> int:
        """What the first pass wants of a node."""
        return blur.node_level(error)

    def advance(self, estimate: Estimate) -> bool:
        """Decide what the next pass wants; False if the picture is done."""
        return blur_decisions.advance(estimate)
