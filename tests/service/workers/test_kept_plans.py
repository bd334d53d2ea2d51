"""Plans that a worker keeps leave the memory to the next job, however large those before it were."""

import hashlib
import io
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from schemas.api.jobs import JobRequest
from service.workers.tasks import TaskFailed, TileDone, TileTask
from tests.service.sending import name_of, textured
from tests.service.workers.bench import Bench

pytestmark = pytest.mark.slow

MEMORY = 1 << 30


def with_texture(bench: Bench, folder: Path, side: int, grey: int) -> TileTask:
    """A tile of another job, whose texture has so many pixels along a side."""
    file = io.BytesIO()
    Image.new("RGB", (side, side), (grey, grey, grey)).save(file, "PNG")
    (folder / "assets" / name_of(file.getvalue()).removeprefix("sha256:")).write_bytes(file.getvalue())
    document = textured(name_of(file.getvalue()))
    document["textures"]["a/b"]["encoding"] = "linear"
    job = f"{side}-{grey}"
    request = JobRequest.model_validate({"scene": document})
    spec = request.model_dump_json(exclude_none=True).encode()
    bench.store.put_spec(job, spec)
    return replace(bench.tile(), job=job, spec_sha256=hashlib.sha256(spec).hexdigest())


def test_each_job_has_the_memory_for_itself(tmp_path: Path) -> None:
    """Four textures that stay would leave no room for a fifth, or for a larger one that fits alone."""
    bench = Bench(tmp_path, memory_bytes=MEMORY)
    try:
        worker = bench.worker()
        for side, grey in [*((2800, grey) for grey in range(5)), (4000, 0), (2800, 0), (4000, 0)]:
            assert isinstance(bench.run(with_texture(bench, tmp_path, side, grey)), TileDone), (side, grey)
        failed = bench.run(with_texture(bench, tmp_path, 8000, 0))
        assert isinstance(failed, TaskFailed)
        assert (failed.code, "1 GiB of memory" in failed.message) == ("out_of_memory", True)
        assert bench.worker() == worker
    finally:
        bench.engine.close()
