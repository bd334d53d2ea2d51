"""Prefix of the names of a render's final files.

A picture that is there already has none, and keeps its names.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "tables_0002"
down_revision = "tables_0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column, empty for what is finished."""
    # SQLite adds a column in place where it has a default. Rebuilding the table would delete its tiles.
    op.add_column("renders", sa.Column("final_prefix", sa.String(16), nullable=False, server_default=""))
