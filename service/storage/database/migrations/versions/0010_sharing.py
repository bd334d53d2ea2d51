"""Renders that jobs share, and shares of the workers that users have."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

_JOINED = sa.text("state IN ('queued', 'running', 'succeeded') AND NOT cancel_requested")
_OPEN = sa.text("finished_at IS NULL")


def upgrade() -> None:
    """Apply."""
    op.add_column("renders", sa.Column("version", sa.String(length=32), nullable=True))
    op.create_index(
        "uq_renders_spec_sha256",
        "renders",
        ["spec_sha256", "version"],
        unique=True,
        sqlite_where=_JOINED,
        postgresql_where=_JOINED,
    )
    op.add_column("jobs", sa.Column("load", sa.Float(), nullable=False, server_default="0"))
    op.execute("UPDATE jobs SET load = predicted_cpu_seconds")
    op.create_index("ix_jobs_open", "jobs", ["owner", "load"], sqlite_where=_OPEN, postgresql_where=_OPEN)
    op.add_column("tiles", sa.Column("payer", sa.String(length=64), nullable=True))
    op.add_column("tiles", sa.Column("charge", sa.Float(), nullable=False, server_default="0"))
    op.create_table(
        "requests",
        sa.Column("job", sa.Integer(), nullable=False),
        sa.Column("body", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["job"], ["jobs.number"], name=op.f("fk_requests_job_jobs"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job", name=op.f("pk_requests")),
    )
    op.create_table(
        "shares",
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("served", sa.Float(), nullable=False),
        sa.Column("turn", sa.Float(), nullable=False),
        sa.Column("active", sa.Boolean(), nullable=False),
        sa.PrimaryKeyConstraint("owner", name=op.f("pk_shares")),
    )
    op.create_index("ix_shares_active", "shares", ["active", "served", "owner"])
    op.create_index("ix_shares_turn", "shares", ["turn"])


def downgrade() -> None:
    """Undo."""
    op.drop_table("shares")
    op.drop_table("requests")
    op.drop_column("tiles", "charge")
    op.drop_column("tiles", "payer")
    op.drop_index("ix_jobs_open", "jobs")
    op.drop_column("jobs", "load")
    op.drop_index("uq_renders_spec_sha256", "renders")
    op.drop_column("renders", "version")
