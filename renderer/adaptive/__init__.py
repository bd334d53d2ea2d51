"""Target quality: samples where the picture needs them, until its error is at most the target.

A picture is a state machine (`estimate.State`). Each state is a pass over all tiles, after which the
controller decides what the next pass requests::

       finer                        more samples
      +-----+                          +----+
      |     v                          |    v
      LATTICE  ------->  PROBES  --->  SAMPLE  --->  DONE
                           |                          ^
                           +--------------------------+
                                  error reached

========  ===================================================================================================
LATTICE   Takes the nodes of a lattice that is refined where the picture is not smooth. A node is a pilot
          sample: one ray through the centre of a pixel, with as little noise as possible. Through a lens,
          where single rays are noisy, a node is sampled.
PROBES    Measures the coverage of border pixels by unshaded rays; pilot samples nearby have the radiance of
          their parts. Samples probes, pixels chosen at random, which measure the error of each stratum.
SAMPLE    Samples pixels where that reduces the error most, in two independent halves whose difference
          estimates the error that remains. Repeated until the target is reached.
DONE      Requests nothing: the target is reached, or more samples would not reduce the error.
========  ===================================================================================================
"""

from renderer.adaptive.estimate import Estimate
from renderer.adaptive.requests import Samples
from renderer.adaptive.tile_rendering import render_samples
from renderer.adaptive.uncertainty import ErrorEstimate

__all__ = ["ErrorEstimate", "Estimate", "Samples", "render_samples"]
