"""Layers: numbers about each pixel beside its colour.

Most come from the one ray through the pixel's centre, those with a statistic from all camera samples.
"""

from renderer.layers.buffers import LayerBuffers
from renderer.layers.layer import Layer, Layers
from renderer.layers.recorders import LAYERS
from renderer.layers.recording import record

__all__ = ["LAYERS", "Layer", "LayerBuffers", "Layers", "record"]
