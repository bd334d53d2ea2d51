"""Pictures on their way to be compared: local files, or jobs of a service."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from schemas.jobs import JobState
from service.client.errors import NoImageError

if TYPE_CHECKING:
    from service.client.client import Client

JOB = "job:"
LAYERS = ("error", "samples", "shape")
"""Layers that say more about a difference than the picture alone."""

PictureSource = str | Path | bytes
"""``job:ID``, the path of a file, or a file's bytes."""


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The picture of a job, and its layers that comparing makes use of.

    Attributes
    ----------
    content
        An NPY file, linear float32.
    layers
        By name, those of `LAYERS` that the job was asked for.
    """

    content: bytes
    layers: Mapping[str, npt.NDArray[Any]]


def sent(source: PictureSource, encoding: str | None) -> dict[str, str]:
    """A picture as a request names it.

    Raises
    ------
    OSError
        Its file cannot be read.
    """
    stated = {"encoding": encoding} if encoding else {}
    if isinstance(source, str) and source.startswith(JOB):
        return {"job": source.removeprefix(JOB)} | stated
    content = source if isinstance(source, bytes) else Path(source).read_bytes()
    return {"content": base64.b64encode(content).decode("ascii")} | stated


def parts_of(client: Client, job_id: str) -> Parts:
    """The picture of a job that has succeeded, with the layers that comparing makes use of.

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
