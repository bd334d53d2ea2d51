"""How far a picture is from NumPy's own limit: its element operations at the speed of arrays in cache.

What the limit leaves out is the way there and back: calls, memory beyond the cache, and all Python.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

import renderer
from accuracy.variations import fixed_quality, label
from benchmarks import references
from benchmarks.counted_arrays import Operation, Tally, counting
from benchmarks.machine import timed_render
from renderer.meshes.files import announced
from schemas.reading import read_scene
from schemas.shapes import MeshFile

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

SHORT, LONG = 256, 8192
"""Elements of the timed arrays. Three of the longer take 200 kB as float64: they stay in the second cache."""
REPEATS = 100
TRIES = 25
QUALITY = fixed_quality("center", 1, "uniform", 64)
"""Light points enough that pair work counts; counting takes ten times as long as rendering."""


class Limit(TypedDict):
    """One scene: element operations, the CPU seconds they and their calls take at least, and what it took."""

    scene: str
    setting: str
    operations: int
    calls: int
    camera_samples: int
    triples: int
    in_cache_seconds: float
    call_seconds: float
    measured_seconds: float


def measure(scene: str) -> Limit:
    """Count the operations of a picture, time each kind of them in cache, and time the picture."""
    path = references.PATHS[scene]
    plan = renderer.compile_scene(path, QUALITY)
    renderer.render(plan)
    result, measured = timed_render(plan)
    rays = result.report["rays"]
    with counting() as tally:
        renderer.render(plan)
    in_cache, calls = _seconds(tally)
    assert QUALITY.light is not None
    return Limit(
        scene=scene,
        setting=label(QUALITY),
        operations=tally.elements.total(),
        calls=tally.calls.total(),
        camera_samples=rays["camera"],
        triples=rays["camera"] * QUALITY.light.samples * _shapes(scene),
        in_cache_seconds=round(in_cache, 3),
        call_seconds=round(calls, 3),
        measured_seconds=round(measured, 3),
    )


def _shapes(scene: str) -> int:
    """Shapes of a scene, each triangle of a mesh one of them."""
    path = references.PATHS[scene]
    shapes = read_scene(path.read_bytes())[0].shapes
    meshes = [(path.parent / shape.asset).read_bytes() for shape in shapes if isinstance(shape, MeshFile)]
    return len(shapes) - len(meshes) + sum(announced(content) for content in meshes)


def _seconds(tally: Tally) -> tuple[float, float]:
    """Seconds of all elements in cache, and of all calls."""
    elements = calls = 0.0
    for operation, count in tally.elements.items():
        element, call = _time_of(operation)
        elements += count * element
        calls += tally.calls[operation] * call
    return elements, calls


def _time_of(operation: Operation) -> tuple[float, float]:
    """Seconds of an element and of a call: the slope between two lengths, and what is left at no length.

    The lengths take turns, so that other work of the machine spoils one try of both; the least counts.
    """
    calls = [_call_of(operation, length) for length in (SHORT, LONG)]
    tries = [[_mean_seconds(call) for call in calls] for _ in range(TRIES)]
    short, long = (min(times) for times in zip(*tries, strict=True))
    element = max(0.0, (long - short) / (LONG - SHORT))
    return element, max(0.0, short - SHORT * element)


def _call_of(operation: Operation, length: int) -> Callable[[], Any]:
    inputs = [_values(char, length) for char in operation.types]
    if operation.name == "move":
        target = np.empty_like(inputs[0])
        return lambda: np.copyto(target, inputs[0])
    ufunc = getattr(np, operation.name)
    if operation.method == "reduce":
        return lambda: ufunc.reduce(inputs[0])
    if operation.method in {"accumulate", "at", "reduceat"}:
        return lambda: ufunc.accumulate(inputs[0])
    out = ufunc(*inputs)
    return lambda: ufunc(*inputs, out=out)


def _values(char: str, length: int) -> NDArray[Any]:
    """Numbers for which every function has a value and takes its usual way."""
    return np.linspace(0.25, 0.75, length).astype(char) if char in "efdg" else np.ones(length, dtype=char)


def _mean_seconds(call: Callable[[], Any]) -> float:
    begun = time.perf_counter()
    for _ in range(REPEATS):
        call()
    return (time.perf_counter() - begun) / REPEATS
