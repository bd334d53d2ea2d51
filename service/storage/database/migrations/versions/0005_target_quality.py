"""Jobs whose passes follow from each other until an error is reached."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply."""
    op.add_column("jobs", sa.Column("target_error", sa.Float(), nullable=True))
    op.add_column("jobs", sa.Column("time_limit", sa.Float(), nullable=True))
    op.add_column("jobs", sa.Column("tile_size", sa.Integer(), nullable=True))
    op.add_column("jobs", sa.Column("merges", sa.JSON(), nullable=False, server_default="[]"))
    op.add_column("jobs", sa.Column("counted_share", sa.Float(), nullable=False, server_default="0"))
    op.add_column("jobs", sa.Column("counted_work", sa.Integer(), nullable=False, server_default="0"))


def downgrade() -> None:
    """Undo."""
    for name in ("counted_work", "counted_share", "merges", "tile_size", "time_limit", "target_error"):
        op.drop_column("jobs", name)
