"""Jobs and renders that stand still, and for how long they have."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

_TABLES = ("renders", "jobs")


def upgrade() -> None:
    """Apply."""
    for table in _TABLES:
        op.add_column(table, sa.Column("paused_at", sa.DateTime(timezone=True), nullable=True))
        op.add_column(
            table, sa.Column("paused_seconds", sa.Float(), nullable=False, server_default=sa.text("0"))
        )


def downgrade() -> None:
    """Undo."""
    for table in _TABLES:
        op.drop_column(table, "paused_seconds")
        op.drop_column(table, "paused_at")
