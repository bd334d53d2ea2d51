"""Who asked for a job, and how: labels, priority, a limit of time, keys of requests that may be repeated."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply."""
    # Jobs so far were submitted where nobody is asked who he is.
    op.add_column("jobs", sa.Column("owner", sa.String(length=64), nullable=False, server_default="local"))
    op.add_column("jobs", sa.Column("labels", sa.JSON(), nullable=False, server_default="{}"))
    op.add_column("jobs", sa.Column("priority", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("jobs", sa.Column("time_limit", sa.Float(), nullable=True))
    op.create_index("ix_jobs_owner_number", "jobs", ["owner", "number"])
    op.create_index("ix_jobs_finished_at", "jobs", ["finished_at"])
    op.create_table(
        "labels",
        sa.Column("job", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=63), nullable=False),
        sa.Column("value", sa.String(length=200), nullable=False),
        sa.ForeignKeyConstraint(
            ["job"], ["jobs.number"], name=op.f("fk_labels_job_jobs"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job", "name", name=op.f("pk_labels")),
    )
    op.create_index("ix_labels_name", "labels", ["name", "value", "job"])
    op.create_table(
        "idempotency_keys",
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("key", sa.String(length=255), nullable=False),
        sa.Column("body_sha256", sa.String(length=64), nullable=False),
        sa.Column("job", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["job"], ["jobs.number"], name=op.f("fk_idempotency_keys_job_jobs"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("owner", "key", name=op.f("pk_idempotency_keys")),
    )
    op.create_index("ix_idempotency_keys_job", "idempotency_keys", ["job"])


def downgrade() -> None:
    """Undo."""
    op.drop_table("idempotency_keys")
    op.drop_table("labels")
    op.drop_index("ix_jobs_finished_at", "jobs")
    op.drop_index("ix_jobs_owner_number", "jobs")
    for name in ("time_limit", "priority", "labels", "owner"):
        op.drop_column("jobs", name)
