"""Room for counts of samples and bytes beyond 32 bits, which PostgreSQL would refuse."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

_COUNTS = (
    ("renders", "total_work"),
    ("renders", "done_work"),
    ("renders", "counted_work"),
    ("assets", "bytes"),
)


def upgrade() -> None:
    """Apply."""
    _change(sa.Integer(), sa.BigInteger())


def downgrade() -> None:
    """Undo."""
    _change(sa.BigInteger(), sa.Integer())


def _change(before: sa.Integer, after: sa.Integer) -> None:
    # An integer of SQLite has 64 bits, whatever it is called.
    if op.get_bind().dialect.name == "postgresql":
        for table, column in _COUNTS:
            op.alter_column(table, column, existing_type=before, type_=after)
