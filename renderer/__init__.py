"""A ray tracer on NumPy arrays that runs only what a scene calls for."""

from renderer.assets import AssetSource
from renderer.compile import compile_scene
from renderer.errors import ImageFileError, RenderError, SceneError
from renderer.execute import TileResult, render_tile
from renderer.plan import RenderPlan
from renderer.rendering import render
from renderer.results import RenderResult, TileEvent
from renderer.scenes import LoadedScene, load_scene
from renderer.tracing import Hits, trace

__all__ = [
    "AssetSource",
    "Hits",
    "ImageFileError",
    "LoadedScene",
    "RenderError",
    "RenderPlan",
    "RenderResult",
    "SceneError",
    "TileEvent",
    "TileResult",
    "compile_scene",
    "load_scene",
    "render",
    "render_tile",
    "trace",
]
