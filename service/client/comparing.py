"""Pictures to be compared: local files, or jobs of a service."""

from __future__ import annotations

import base64
import hashlib
import io
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from schemas.api.jobs import Job, JobState
from service.client.errors import NoImageError
from service.client.parcels import PREFIX
from service.client.pictures import Picture

if TYPE_CHECKING:
    from service.client.client import Client

JOB = "job:"
MOST_INLINE_BYTES = 4 << 20
"""Larger files are uploaded first: two of them in Base64 may be more than a service accepts in a request."""
LAYERS = ("error", "samples", "shape")
"""Layers that a comparison uses besides the picture."""

PictureSource = str | PathLike[str] | bytes | Job | Picture | npt.NDArray[Any] | Any
"""A job or ``job:ID``; the path of a file or its bytes; an array (H, W, 3), an image of Pillow, or what the
renderer returns."""


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The picture of a job, and the layers that a comparison uses.

    Attributes
    ----------
    content
        An NPY file, linear float32.
    layers
        By name, those of `LAYERS` that were requested for the job.
    """

    content: bytes
    layers: Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Sent:
    """A picture as a request names it, and the content that is uploaded before, by its SHA-256."""

    document: Mapping[str, str]
    contents: Mapping[str, bytes] = field(default_factory=dict)


def sent(source: PictureSource, encoding: str | None) -> Sent:
    """A picture as a request names it.

    Raises
    ------
    OSError
        Its file cannot be read.
    TypeError
        It is not a picture.
    """
    stated = {"encoding": encoding} if encoding else {}
    if isinstance(source, str) and source.startswith(JOB):
        return Sent({"job": source.removeprefix(JOB)} | stated)
    if isinstance(source, Job):
        return Sent({"job": source.id} | stated)
    content = _file(source)
    if len(content) <= MOST_INLINE_BYTES:
        return Sent({"content": base64.b64encode(content).decode("ascii")} | stated)
    sha256 = hashlib.sha256(content).hexdigest()
    return Sent({"asset": f"{PREFIX}{sha256}"} | stated, {sha256: content})


def _file(source: Any) -> bytes:
    """The bytes of a PNG, NPY or EXR file of a picture."""
    if isinstance(source, bytes | bytearray | memoryview):
        return bytes(source)
    if isinstance(source, Picture):
        return source.content
    if isinstance(source, str | PathLike):
        return Path(source).read_bytes()
    buffer = io.BytesIO()
    pixels = getattr(source, "image", source)
    if isinstance(pixels, np.ndarray):
        np.save(buffer, pixels, allow_pickle=False)
    # An image of Pillow exists only where Pillow is loaded.
    elif (pillow := sys.modules.get("PIL.Image")) and isinstance(source, pillow.Image):
        source.save(buffer, format="PNG")
    else:
        kind = type(source).__name__
        raise TypeError(f"A picture is a job, a path, bytes, an array or a Pillow image, not {kind}.")
    return buffer.getvalue()


def parts_of(client: Client, job_id: str) -> Parts:
    """The picture of a job that has succeeded, with the layers that a comparison uses.

    Raises
    ------
    NoImageError
        There is no complete picture, or not yet.
    """
    job = client.get(job_id)
    if job.state is not JobState.SUCCEEDED:
        raise NoImageError(f"Job {job_id} has no complete picture; it is {job.state}.", job_id=job_id)
    names = [name for name in LAYERS if name in job.links.layers]
    layers = {name: client.layer(job_id, name) for name in names}
    return Parts(client.picture(job_id, "npy").content, layers)
