"""Pinned jobs, and which assets are needed by which render."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

_ASSET = re.compile(rb"sha256:([0-9a-f]{64})")
_SENT = sa.text(
    "SELECT jobs.render_number, requests.body FROM jobs JOIN requests ON requests.job = jobs.number "
    "WHERE jobs.render_number IS NOT NULL"
)
# Of renders older than the kept requests nobody knows what they need: it may be anything.
_UNKNOWN = sa.text(
    "INSERT INTO asset_uses (render, sha256) SELECT renders.number, assets.sha256 FROM renders, assets "
    "WHERE NOT EXISTS (SELECT 1 FROM jobs JOIN requests ON requests.job = jobs.number "
    "WHERE jobs.render_number = renders.number)"
)


def upgrade() -> None:
    """Apply."""
    op.add_column("jobs", sa.Column("pinned", sa.Boolean(), nullable=False, server_default=sa.false()))
    # Others refer to assets: the table cannot be rebuilt, and a column that is added needs a constant.
    never = sa.text("'1970-01-01 00:00:00'")
    moment = sa.DateTime(timezone=True)
    op.add_column("assets", sa.Column("used_at", moment, nullable=False, server_default=never))
    op.execute("UPDATE assets SET used_at = created_at")
    uses = op.create_table(
        "asset_uses",
        sa.Column("render", sa.Integer(), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.ForeignKeyConstraint(
            ["render"], ["renders.number"], name=op.f("fk_asset_uses_render_renders"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("render", "sha256", name=op.f("pk_asset_uses")),
    )
    op.create_index("ix_asset_uses_sha256", "asset_uses", ["sha256"])
    if found := [{"render": render, "sha256": sha256} for render, sha256 in sorted(set(_uses()))]:
        op.bulk_insert(uses, found)
    op.execute(_UNKNOWN)


def _uses() -> Iterator[tuple[int, str]]:
    for render, body in op.get_bind().execute(_SENT):
        yield from ((render, name.decode()) for name in _ASSET.findall(zlib.decompress(body)))


def downgrade() -> None:
    """Undo."""
    op.drop_table("asset_uses")
    op.drop_column("assets", "used_at")
    op.drop_column("jobs", "pinned")
