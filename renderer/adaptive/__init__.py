"""Target quality: samples where the picture needs them, until its error is at most the target.

A picture is a state machine (`estimate.State`). Each state is a pass over all tiles; when they are all there,
the controller decides about the whole picture what the next pass asks for::

       finer                        more samples
      +-----+                          +----+
      |     v                          |    v
      LATTICE  ------->  PROBES  --->  SAMPLE  --->  DONE
                           |                          ^
                           +--------------------------+
                                  error reached

========  ===================================================================================================
LATTICE   The nodes of a lattice that grows finer where the picture is not smooth. A node is a pilot sample:
          one ray through the middle of a pixel, with as little noise as may be. Through a lens, where no ray
          alone says much, a node is sampled.
PROBES    Many rays find which shapes the pixels at borders show; pilot samples nearby say how bright these
          are. Probes, pixels chosen at random, measure in each stratum how far from the truth pixels are.
SAMPLE    Where that is too far, pixels are sampled, in two halves whose difference estimates the error left.
          This is decided again until the error is reached.
DONE      Nothing more is requested.
========  ===================================================================================================
"""

from renderer.adaptive.estimate import Estimate
from renderer.adaptive.samples import Samples
from renderer.adaptive.tile_rendering import render_samples
from renderer.adaptive.uncertainty import ErrorEstimate

__all__ = ["ErrorEstimate", "Estimate", "Samples", "render_samples"]
