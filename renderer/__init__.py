"""A ray tracer on NumPy arrays that runs only what a scene calls for."""

from typing import TYPE_CHECKING

from schemas.exports import lazy_names

if TYPE_CHECKING:
    from renderer.assets import AssetSource
    from renderer.compiling import compile_scene
    from renderer.errors import ImageFileError, RenderError, SceneError
    from renderer.fixed_tiles import TileRendering, TileResult, render_tile
    from renderer.plan.plan import RenderPlan
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
    "TileRendering",
    "TileResult",
    "compile_scene",
    "load_scene",
    "render",
    "render_tile",
    "trace",
]

HOMES = {
    "assets": ("AssetSource",),
    "compiling": ("compile_scene",),
    "errors": ("ImageFileError", "RenderError", "SceneError"),
    "plan.plan": ("RenderPlan",),
    "rendering": ("render",),
    "results": ("RenderResult", "TileEvent"),
    "scenes": ("LoadedScene", "load_scene"),
    "fixed_tiles": ("TileRendering", "TileResult", "render_tile"),
    "tracing": ("Hits", "trace"),
}
"""Modules, each loaded on the first use of one of its names: comparing pictures renders nothing."""

__getattr__, __dir__ = lazy_names(__name__, HOMES)
