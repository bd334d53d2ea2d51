"""Target quality: samples where the picture needs them, until its error is at most the target.

A picture is a state machine (`states.State`). Each state is a pass over all tiles; when they are all there, a
table of transitions decides about the whole picture what the next pass asks for::

                 finer                                    more samples
                +-----+                                    +------+
                |     v                                    |      v
    pinhole ->  PREVIEW  -->  BORDERS  -->  PROBES  -->  SAMPLE  -->  DONE
                                              ^  |                     ^
                finer                         |  +---------------------+
                +-----+                       |     error reached
                |     v                       |
    lens    ->  LATTICE  ---------------------+

========  ===================================================================================================
PREVIEW   Pilot samples: one ray through the middle of a pixel, with as little noise as may be, on a lattice
          that grows finer where the picture is not smooth.
LATTICE   The same for a picture through a lens, whose nodes are sampled.
BORDERS   Many rays find which shapes the pixels at borders show; pilot samples nearby say how bright these
          are.
PROBES    Probes, pixels chosen at random, measure how far pilot samples of each stratum are from the truth.
SAMPLE    Where that is too far, pixels are sampled, in two halves whose difference estimates the error left.
          This is decided again until the error is reached.
DONE      Nothing more is requested.
========  ===================================================================================================

The tables are `decisions.TRANSITIONS` and, through a lens, `blur_decisions.TRANSITIONS`.
"""

from renderer.adaptive.estimate import Estimate
from renderer.adaptive.samples import Samples
from renderer.adaptive.tile_rendering import render_samples
from renderer.adaptive.uncertainty import ErrorEstimate

__all__ = ["ErrorEstimate", "Estimate", "Samples", "render_samples"]
