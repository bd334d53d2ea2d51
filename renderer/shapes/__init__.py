"""Shapes in families: all shapes of one kind as arrays, intersected with blocks of rays."""

from renderer.shapes.family import Family

__all__ = ["Family"]
