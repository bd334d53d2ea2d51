"""Which kind of place an address names."""

from __future__ import annotations

from pathlib import Path

from service.storage.folder import Folder
from service.storage.objects import Objects

BUCKET = "s3://"
JOBS, ASSETS = "jobs", "assets"
"""What lies in a place."""


def place_of(address: str) -> Objects:
    """Give the bucket of an address ``s3://bucket/prefix``, or the folder of any other.

    Raises
    ------
    StoreMissingError
        If the extra for buckets is not installed.
    """
    if not address.startswith(BUCKET):
        return Folder(Path(address))
    from service.storage.bucket import Bucket  # noqa: PLC0415  (an extra)

    return Bucket(address)
