"""What a job was asked to render, as it lies in the store, and the plan made from it."""

from __future__ import annotations

import json

import renderer
from accuracy.inspection import inspection_plan
from schemas.jobs import JobRequest


def compile_request(request: JobRequest, assets: renderer.AssetSource) -> renderer.RenderPlan:
    """Compile the scene of a request at the request's quality, with its layers.

    Raises
    ------
    renderer.SceneError
        If the scene cannot be compiled; pointers start at the scene.
    """
    scene = renderer.load_scene(request.scene, assets=assets)
    return renderer.compile_scene(scene, request.quality, layers=request.layers)


def compile_spec(spec: bytes, assets: renderer.AssetSource) -> renderer.RenderPlan:
    """Compile a request that was accepted before, and that no limit concerns any more."""
    return compile_request(JobRequest.model_validate(json.loads(spec)), assets)


def compile_inspected(spec: bytes, assets: renderer.AssetSource) -> renderer.RenderPlan:
    """Compile a request that was accepted before for the inspection of single pixels."""
    request = JobRequest.model_validate(json.loads(spec))
    return inspection_plan(renderer.load_scene(request.scene, assets=assets), request.quality)
