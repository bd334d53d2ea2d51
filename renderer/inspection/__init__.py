"""One pixel explained: what its ray met, what each light adds there, what is in the way."""

from renderer.inspection.pixels import inspect
from renderer.inspection.plans import inspection_plan

__all__ = ["inspect", "inspection_plan"]
