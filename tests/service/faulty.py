"""The service with faults put in: ``python -m tests.service.faulty`` in place of ``service``.

The name of a scene says what happens to the worker that renders it. Workers import this module, too.
"""

import os
import signal
import time
from pathlib import Path
from typing import Any

import renderer
from renderer.images import files as image_files

GATE = "FAULTY_COMPOSE_GATE"
"""Variable that names a file: while it is there, workers wait before they write a final picture. The first
that waits makes a file of this name with ``.reached`` after it."""

_tile_rendering = renderer.TileRendering
_encoded = image_files.encode_npy


def _faulty_rendering(plan: renderer.RenderPlan, *rest: Any, **options: Any) -> Any:
    match plan.document.name:
        case "poison":
            os.kill(os.getpid(), signal.SIGKILL)
        case "endless":
            while True:
                time.sleep(1.0)
    return _tile_rendering(plan, *rest, **options)


def _encode_npy(*arguments: Any) -> bytes:
    gate = Path(os.environ[GATE])
    while gate.exists():
        Path(f"{gate}.reached").touch()
        time.sleep(0.05)
    return _encoded(*arguments)


if __name__ in {"__main__", "__mp_main__"}:
    vars(renderer)["TileRendering"] = _faulty_rendering
    if GATE in os.environ:
        vars(image_files)["encode_npy"] = _encode_npy
if __name__ == "__main__":
    # Workers import this under the other name, and start without the server.
    from service.server import inherited_listener, run
    from service.settings import Settings

    run(Settings(), inherited_listener())
