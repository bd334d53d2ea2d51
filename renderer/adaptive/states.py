"""The states of a picture of target quality; the package's docstring draws how they follow each other."""

from enum import Enum


class State(Enum):
    """What the next pass of a picture does."""

    PREVIEW = "preview"
    """Takes pilot samples on a lattice that grows finer where the picture is not smooth."""

    LATTICE = "lattice"
    """Samples the nodes of such a lattice, through a lens."""

    BORDERS = "borders"
    """Covers pixels at borders with rays that find which shapes they show."""

    PROBES = "probes"
    """Samples probes, which measure how far the picture is from the converged one."""

    SAMPLE = "sample"
    """Samples where that lowers the error most."""

    DONE = "done"
    """There is none: the error is reached, or more samples would not lower it."""

    @property
    def is_measured(self) -> bool:
        """Whether probes have measured how far the picture is from the converged one."""
        return self in (State.SAMPLE, State.DONE)
