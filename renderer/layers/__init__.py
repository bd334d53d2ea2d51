"""Layers: numbers about each pixel beside its colour, from the one ray through the pixel's centre."""

from renderer.layers.layer import Layer, Layers
from renderer.layers.recorders import LAYERS
from renderer.layers.recording import record

__all__ = ["LAYERS", "Layer", "Layers", "record"]
