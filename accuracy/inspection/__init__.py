"""One pixel explained: what its ray hits, what each light adds there, what is in the way."""

from accuracy.inspection.pixels import inspect, inspection_plan

__all__ = ["inspect", "inspection_plan"]
