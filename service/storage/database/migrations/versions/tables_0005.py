"""Expiry and last use of keys, and CPU seconds charged to each user."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "tables_0005"
down_revision = "tables_0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; what was charged before is not known."""
    op.add_column("api_keys", sa.Column("expires_at", sa.DateTime(timezone=True)))
    op.add_column("api_keys", sa.Column("last_used_at", sa.DateTime(timezone=True)))
    op.add_column("shares", sa.Column("charged", sa.Float, nullable=False, server_default="0"))
