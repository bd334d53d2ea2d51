"""Checksums of stored files, and what was found to be damaged.

Existing pictures have no checksums. Renders that are never shared get the digest of their request, like the
others, by which workers verify it.
"""

from __future__ import annotations

import hashlib
import zlib

import sqlalchemy as sa
from alembic import op

revision = "tables_0004"
down_revision = "tables_0003"
branch_labels = None
depends_on = None

# The store has their request as it was sent, and the job of their id has it in the database.
PRIVATE = sa.text(
    "SELECT renders.number, requests.body FROM renders JOIN jobs ON jobs.id = renders.id"
    " JOIN requests ON requests.job = jobs.number WHERE renders.version IS NULL"
)
DIGEST = sa.text("UPDATE renders SET spec_sha256 = :digest WHERE number = :number")


def upgrade() -> None:
    """Add columns, and fill in digests for the rows that there are."""
    op.add_column("renders", sa.Column("checksums", sa.JSON))
    op.add_column("renders", sa.Column("damage", sa.Text))
    count = sa.Column("damage_count", sa.Integer, nullable=False, server_default="0")
    op.add_column("renders", count)
    connection = op.get_bind()
    digests = [
        {"number": number, "digest": digest}
        for number, body in connection.execute(PRIVATE)
        if (digest := _digest(body)) is not None
    ]
    if digests:
        connection.execute(DIGEST, digests)


def _digest(body: bytes) -> str | None:
    try:
        return hashlib.sha256(zlib.decompress(body)).hexdigest()
    except zlib.error:
        # A damaged row: only its job will fail.
        return None
