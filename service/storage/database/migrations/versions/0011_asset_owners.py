"""Owners of assets: who has uploaded what, so that nobody uses what another has."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from datetime import UTC, datetime

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

_NAMED = re.compile(rb'"sha256:([0-9a-f]{64})"')
_LOCAL = "local"
_AT_ONCE = 100


def upgrade() -> None:
    """Apply."""
    op.create_table(
        "asset_owners",
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["sha256"], ["assets.sha256"], name=op.f("fk_asset_owners_sha256_assets"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("owner", "sha256", name=op.f("pk_asset_owners")),
    )
    op.create_index(op.f("ix_asset_owners_sha256"), "asset_owners", ["sha256"])
    _find_owners()


def _find_owners() -> None:
    """Give what was uploaded before to those whose jobs name it; to all, where nobody had a key."""
    connection = op.get_bind()
    known = set(connection.scalars(sa.text("SELECT sha256 FROM assets")))
    if not known:
        return
    keys_made = connection.scalar(sa.text("SELECT count(*) FROM api_keys"))
    pairs = set() if keys_made else {(_LOCAL, sha256) for sha256 in known}
    pairs |= {(owner, sha256) for owner, body in _requests() for sha256 in _named(body) if sha256 in known}
    table = sa.table(
        "asset_owners",
        sa.column("owner", sa.String),
        sa.column("sha256", sa.String),
        sa.column("created_at", sa.DateTime(timezone=True)),
    )
    now = datetime.now(UTC)
    rows = [{"owner": owner, "sha256": sha256, "created_at": now} for owner, sha256 in sorted(pairs)]
    op.bulk_insert(table, rows)


def _requests() -> Iterator[tuple[str, bytes]]:
    """Owners of jobs with the bodies of their requests; few at once, for they may be large."""
    connection, last = op.get_bind(), -1
    query = sa.text(
        "SELECT requests.job, jobs.owner, requests.body FROM requests "
        "JOIN jobs ON jobs.number = requests.job WHERE requests.job > :last ORDER BY requests.job LIMIT :most"
    )
    while rows := connection.execute(query, {"last": last, "most": _AT_ONCE}).all():
        yield from ((owner, bytes(body)) for _, owner, body in rows)
        last = rows[-1][0]


def _named(body: bytes) -> set[str]:
    return {found.decode() for found in _NAMED.findall(zlib.decompress(body))}


def downgrade() -> None:
    """Undo."""
    op.drop_table("asset_owners")
