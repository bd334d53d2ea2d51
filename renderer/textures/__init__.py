"""Textures: values that vary over a surface."""

from renderer.textures.sampling import Texture

__all__ = ["Texture"]
