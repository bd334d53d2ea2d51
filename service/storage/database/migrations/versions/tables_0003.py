"""Stored counts: sizes of pictures, places in the queue, failures, uses of assets.

Sizes of pictures that are there already stay unknown: only the store has them, and the service asks it once.
"""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "tables_0003"
down_revision = "tables_0002"
branch_labels = None
depends_on = None

COUNT = sa.BigInteger().with_variant(sa.Integer(), "sqlite")

# Name, table, columns, and the condition on rows where there is one.
INDICES: tuple[tuple[str, str, tuple[Any, ...], str | None], ...] = (
    ("ix_renders_idle", "renders", ("idle_since", "number"), "idle_since IS NOT NULL"),
    (
        "ix_renders_unmeasured",
        "renders",
        ("state", "stored_bytes", "number"),
        "state = 'succeeded' AND stored_bytes IS NULL",
    ),
    (
        "ix_renders_with_error",
        "renders",
        ("number",),
        "target_error IS NOT NULL AND image_sha256 IS NOT NULL",
    ),
    ("ix_jobs_owner_state", "jobs", ("owner", "state", "number"), None),
    ("ix_jobs_pinned", "jobs", ("owner",), "pinned"),
    (
        "ix_jobs_with_picture",
        "jobs",
        ("state", "finished_at", "number"),
        "state = 'succeeded' AND NOT pinned",
    ),
    ("ix_jobs_finished_at", "jobs", ("finished_at", "number"), "finished_at IS NOT NULL AND NOT pinned"),
    (
        "ix_jobs_queue",
        "jobs",
        (
            *("state", "owner", sa.text("priority DESC"), "number"),
            *("render_number", "coarse_cpu_seconds", "paused_at"),
        ),
        "state = 'queued' AND paused_at IS NULL",
    ),
    ("ix_labels_owner", "labels", ("owner", "name", "value", "job"), None),
    ("ix_idempotency_keys_created_at", "idempotency_keys", ("created_at",), None),
    ("ix_assets_unused", "assets", ("used_at",), "renders = 0"),
)
# What SQL can say on both kinds of database.
FILLED = (
    "UPDATE labels SET owner = (SELECT owner FROM jobs WHERE jobs.number = labels.job)",
    "UPDATE assets SET renders = (SELECT count(*) FROM asset_uses WHERE asset_uses.sha256 = assets.sha256)",
    """
    UPDATE renders SET idle_since = (SELECT max(finished_at) FROM jobs WHERE render_number = renders.number)
    WHERE state = 'succeeded'
    AND NOT EXISTS (SELECT 1 FROM jobs WHERE render_number = renders.number AND pinned)
    """,
)


def upgrade() -> None:
    """Add columns and indices, and fill them in for the rows that there are."""
    _add_columns()
    for statement in FILLED:
        op.execute(statement)
    _enter_totals()
    _price_coarse_pictures()
    op.drop_index("ix_jobs_finished_at", "jobs")
    for name, table, index, where in INDICES:
        condition = None if where is None else sa.text(where)
        op.create_index(name, table, list(index), sqlite_where=condition, postgresql_where=condition)


def _add_columns() -> None:
    # With defaults: SQLite adds such columns in place. Rebuilding a table would delete what refers to it.
    count = sa.Column("compose_deaths", sa.Integer, nullable=False, server_default="0")
    op.add_column("renders", count)
    op.add_column("renders", sa.Column("stored_bytes", COUNT))
    op.add_column("renders", sa.Column("encodings", sa.JSON, nullable=False, server_default="[]"))
    op.add_column("renders", sa.Column("idle_since", sa.DateTime(timezone=True)))
    op.add_column("jobs", sa.Column("coarse_cpu_seconds", sa.Float, nullable=False, server_default="0"))
    op.add_column("labels", sa.Column("owner", sa.String(64), nullable=False, server_default=""))
    op.add_column("assets", sa.Column("renders", sa.Integer, nullable=False, server_default="0"))


def _enter_totals() -> None:
    totals = op.create_table(
        "totals",
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("amount", COUNT, nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_totals"),
    )
    found = op.get_bind().execute(sa.text("SELECT failure FROM jobs WHERE state = 'failed'"))
    failed = Counter(_code(failure) for (failure,) in found)
    if failed:
        op.bulk_insert(totals, [{"name": f"failed:{code}", "amount": failed[code]} for code in failed])


def _price_coarse_pictures() -> None:
    """Predict for jobs that have not begun what their coarse picture costs: its part of all samples."""
    waiting = sa.text(
        "SELECT jobs.number, renders.width, renders.height, renders.passes, renders.total_work,"
        " renders.predicted_cpu_seconds FROM jobs JOIN renders ON renders.number = jobs.render_number"
        " WHERE jobs.state = 'queued'"
    )
    connection = op.get_bind()
    prices = [{"job": job, "price": _price(*columns)} for job, *columns in connection.execute(waiting)]
    if prices:
        connection.execute(sa.text("UPDATE jobs SET coarse_cpu_seconds = :price WHERE number = :job"), prices)


# What damaged rows have in these columns raises: they are counted as nothing, and the others are upgraded.
DAMAGED = (TypeError, LookupError, ValueError, ZeroDivisionError, AttributeError)


def _price(width: int, height: int, passes: Any, total_work: int, cpu_seconds: float) -> float:
    try:
        stride = _document(passes)[0]["stride"]
        return float(cpu_seconds * (-(-width // stride) * -(-height // stride)) / total_work)
    except DAMAGED:
        return 0.0


def _code(failure: Any) -> str:
    try:
        return str(_document(failure)["code"])
    except DAMAGED:
        return "None"


def _document(value: Any) -> Any:
    """Read JSON, which one kind of database returns as text."""
    return json.loads(value) if isinstance(value, str) else value
