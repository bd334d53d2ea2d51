"""A ray tracer on NumPy arrays that runs only what a scene calls for."""

from renderer.assets import AssetSource
from renderer.compile import compile_scene
from renderer.errors import ImageFileError, RenderError, SceneError
from renderer.execute import TileResult, render_tile
from renderer.plan import RenderPlan
from renderer.scenes import LoadedScene, load_scene

__all__ = [
    "AssetSource",
    "ImageFileError",
    "LoadedScene",
    "RenderError",
    "RenderPlan",
    "SceneError",
    "TileResult",
    "compile_scene",
    "load_scene",
    "render_tile",
]
