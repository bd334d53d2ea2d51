"""Explanation of a pixel: its ray's hit, the contribution of each light, and the occluders."""

from accuracy.inspection.pixels import inspect, inspection_plan

__all__ = ["inspect", "inspection_plan"]
