"""Faults: processes that are killed or stopped, disks and databases that are away, clocks that are set."""
