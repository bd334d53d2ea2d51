"""What of a picture is wanted first, which quality a job asked for, and which tiles are at work."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

_RUNNING = sa.text("state = 'running'")


def upgrade() -> None:
    """Apply."""
    op.add_column("renders", sa.Column("focus", sa.JSON(), nullable=True))
    op.add_column("jobs", sa.Column("quality", sa.JSON(), nullable=True))
    op.create_index("ix_tiles_running", "tiles", ["render"], sqlite_where=_RUNNING, postgresql_where=_RUNNING)


def downgrade() -> None:
    """Undo."""
    op.drop_index("ix_tiles_running", "tiles")
    op.drop_column("jobs", "quality")
    op.drop_column("renders", "focus")
