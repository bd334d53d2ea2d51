"""One pixel explained: what its ray met, what each light adds there, what is in the way."""

from accuracy.inspection.pixels import inspect
from accuracy.inspection.plans import inspection_plan

__all__ = ["inspect", "inspection_plan"]
