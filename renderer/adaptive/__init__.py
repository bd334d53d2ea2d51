"""Target quality: samples where the picture needs them, until its error is what was asked for.

A picture begins with first looks: one ray through the middle of a pixel, with as little noise as may be, on
a lattice that grows finer where the picture is not smooth. At borders many rays tell which shapes a pixel
shows, and first looks nearby how bright they are. Probes, pixels chosen by lot, tell how far first
looks of each sort are from the truth. Where that is too far, pixels are sampled, in two halves whose
difference tells the error that is left.
"""

from renderer.adaptive.estimate import Estimate
from renderer.adaptive.samples import Samples, render_samples
from renderer.adaptive.uncertainty import ErrorEstimate

__all__ = ["ErrorEstimate", "Estimate", "Samples", "render_samples"]
