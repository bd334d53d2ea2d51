"""What every pass of a job of fixed quality has cost, and why it tells no error."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Apply."""
    op.add_column("jobs", sa.Column("pass_costs", sa.JSON(), nullable=False, server_default="[]"))
    op.add_column("jobs", sa.Column("error_unknown", sa.Text(), nullable=True))


def downgrade() -> None:
    """Undo."""
    for name in ("error_unknown", "pass_costs"):
        op.drop_column("jobs", name)
