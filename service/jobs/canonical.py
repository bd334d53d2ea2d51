"""The canonical form of a request: requests for the same picture have the same form.

Not all requests for equal pictures have the same form. Names of shapes, materials and textures count, since
plans and answers contain them: names of one user are never shown to another.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version as installed

from schemas.api.jobs import JobRequest
from schemas.quality import FixedQuality
from schemas.scene import Scene


@dataclass(frozen=True)
class Spec:
    """A request as workers read it, its digest, and the version of the renderer.

    One without a version is never shared.
    """

    content: bytes
    sha256: str
    version: str | None


def spec_of(request: JobRequest) -> Spec:
    """Return the specification of a request, independent of its user and formatting.

    The order of members, defaults that are written out, the name of the scene, labels, priority and limits of
    time of fixed quality do not count; assets stand for their content.
    """
    bare = JobRequest(scene=request.scene, quality=request.quality, layers=request.layers)
    if isinstance(bare.quality, FixedQuality):
        bare = _sampled(bare, bare.quality)
    scene = bare.scene.model_copy(
        update={
            "name": None,
            "materials": dict(sorted(bare.scene.materials.items())),
            "textures": dict(sorted(bare.scene.textures.items())),
        }
    )
    content = bare.model_copy(update={"scene": scene}).model_dump_json(exclude_defaults=True).encode()
    return Spec(content, hashlib.sha256(content).hexdigest(), _version())


def private_spec(body: bytes) -> Spec:
    """Return the specification of a request that shares no picture."""
    return Spec(body, hashlib.sha256(body).hexdigest(), None)


def compact(body: bytes) -> bytes:
    """Write an admitted request again as short as JSON can be: its blanks and idle digits take no room."""
    return json.dumps(json.loads(body), ensure_ascii=False, separators=(",", ":")).encode()


def _sampled(request: JobRequest, quality: FixedQuality) -> JobRequest:
    """Let the samples of a request be those of its scene."""
    sampling = request.scene.sampling
    asked = {"antialiasing": quality.antialiasing, "light": quality.light}
    sampling = sampling.model_copy(update={name: part for name, part in asked.items() if part is not None})
    scene: Scene = request.scene.model_copy(update={"sampling": sampling})
    rest = quality.model_copy(update={"antialiasing": None, "light": None})
    return request.model_copy(
        update={"scene": scene, "quality": rest if rest.precision != "single" else None}
    )


@cache
def _version() -> str:
    return installed("penumbra-render")
