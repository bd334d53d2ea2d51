"""Renders apart from the jobs that ask for them: every job so far gets a render of its own."""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

_STATES = "state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled', 'expired')"
_OF_RENDERS = (
    *("number", "id", "state", "cancel_requested", "width", "height", "spec_sha256", "passes", "display"),
    *("layers", "total_steps", "done_steps", "total_work", "done_work", "last_seq", "compose_attempt"),
    *("predicted_cpu_seconds", "cpu_seconds", "rays", "work", "numerics", "target_error", "time_limit"),
    *("tile_size", "merges", "counted_share", "counted_work", "pass_costs", "error_unknown"),
    *("image_sha256", "started_at"),
)
_OF_JOBS = (
    *("number", "id", "name", "state", "plan", "warnings", "predicted_cpu_seconds", "failure"),
    *("created_at", "started_at", "finished_at"),
)
_OF_TILES = (
    *("pass_index", "tile", "x0", "y0", "x1", "y1", "state", "attempt", "deaths", "seq", "crc32"),
    "cpu_seconds",
)


def upgrade() -> None:
    """Apply."""
    # A table that others refer to cannot be rebuilt in place on SQLite: dropping it would empty them.
    op.execute("CREATE TABLE moved_tiles AS SELECT * FROM tiles")
    op.execute("CREATE TABLE moved_jobs AS SELECT * FROM jobs")
    op.drop_table("tiles")
    op.drop_table("jobs")
    _make_renders()
    _make_jobs()
    _make_tiles()
    _copy("moved_jobs", "renders", _OF_RENDERS)
    _copy("moved_jobs", "jobs", _OF_JOBS, number="render_number")
    _copy("moved_tiles", "tiles", _OF_TILES, job="render")
    op.drop_table("moved_tiles")
    op.drop_table("moved_jobs")
    if op.get_bind().dialect.name == "postgresql":
        _continue_numbers()


def _copy(source: str, target: str, columns: tuple[str, ...], **renamed: str) -> None:
    """Copy columns as they are, and some under other names."""
    found: list[sa.ColumnClause[Any]] = [sa.column(name) for name in (*columns, *renamed)]
    names = [*columns, *renamed.values()]
    rows = sa.select(*found).select_from(sa.table(source))
    op.execute(sa.table(target, *map(sa.column, names)).insert().from_select(names, rows))


def _make_renders() -> None:
    op.create_table(
        "renders",
        sa.Column("number", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("state", sa.String(length=16), nullable=False),
        sa.Column("cancel_requested", sa.Boolean(), nullable=False),
        sa.Column("width", sa.Integer(), nullable=False),
        sa.Column("height", sa.Integer(), nullable=False),
        sa.Column("spec_sha256", sa.String(length=64), nullable=False),
        sa.Column("passes", sa.JSON(), nullable=False),
        sa.Column("display", sa.JSON(), nullable=False),
        sa.Column("layers", sa.JSON(), nullable=False),
        sa.Column("total_steps", sa.Integer(), nullable=False),
        sa.Column("done_steps", sa.Integer(), nullable=False),
        sa.Column("total_work", sa.Integer(), nullable=False),
        sa.Column("done_work", sa.Integer(), nullable=False),
        sa.Column("last_seq", sa.Integer(), nullable=False),
        sa.Column("compose_attempt", sa.Integer(), nullable=False),
        sa.Column("predicted_cpu_seconds", sa.Float(), nullable=False),
        sa.Column("cpu_seconds", sa.Float(), nullable=False),
        sa.Column("rays", sa.JSON(), nullable=False),
        sa.Column("work", sa.JSON(), nullable=False),
        sa.Column("numerics", sa.JSON(), nullable=False),
        sa.Column("target_error", sa.Float(), nullable=True),
        sa.Column("time_limit", sa.Float(), nullable=True),
        sa.Column("tile_size", sa.Integer(), nullable=True),
        sa.Column("merges", sa.JSON(), nullable=False),
        sa.Column("counted_share", sa.Float(), nullable=False),
        sa.Column("counted_work", sa.Integer(), nullable=False),
        sa.Column("pass_costs", sa.JSON(), nullable=False),
        sa.Column("error_unknown", sa.Text(), nullable=True),
        sa.Column("image_sha256", sa.String(length=64), nullable=True),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=True),
        sa.CheckConstraint(_STATES, name=op.f("ck_renders_state")),
        sa.PrimaryKeyConstraint("number", name=op.f("pk_renders")),
        sa.UniqueConstraint("id", name=op.f("uq_renders_id")),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_renders_state_number", "renders", ["state", "number"])


def _make_jobs() -> None:
    op.create_table(
        "jobs",
        sa.Column("number", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("name", sa.Text(), nullable=True),
        sa.Column("state", sa.String(length=16), nullable=False),
        sa.Column("render_number", sa.Integer(), nullable=True),
        sa.Column("parting", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("plan", sa.JSON(), nullable=False),
        sa.Column("warnings", sa.JSON(), nullable=False),
        sa.Column("predicted_cpu_seconds", sa.Float(), nullable=False),
        sa.Column("failure", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.CheckConstraint(_STATES, name=op.f("ck_jobs_state")),
        sa.ForeignKeyConstraint(
            ["render_number"], ["renders.number"], name=op.f("fk_jobs_render_number_renders")
        ),
        sa.PrimaryKeyConstraint("number", name=op.f("pk_jobs")),
        sa.UniqueConstraint("id", name=op.f("uq_jobs_id")),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_jobs_state_number", "jobs", ["state", "number"])
    op.create_index("ix_jobs_render_number", "jobs", ["render_number"])


def _make_tiles() -> None:
    op.create_table(
        "tiles",
        sa.Column("render", sa.Integer(), nullable=False),
        sa.Column("pass_index", sa.Integer(), nullable=False),
        sa.Column("tile", sa.Integer(), nullable=False),
        sa.Column("x0", sa.Integer(), nullable=False),
        sa.Column("y0", sa.Integer(), nullable=False),
        sa.Column("x1", sa.Integer(), nullable=False),
        sa.Column("y1", sa.Integer(), nullable=False),
        sa.Column("state", sa.String(length=8), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("deaths", sa.Integer(), nullable=False),
        sa.Column("seq", sa.Integer(), nullable=True),
        sa.Column("crc32", sa.BigInteger(), nullable=True),
        sa.Column("cpu_seconds", sa.Float(), nullable=True),
        sa.CheckConstraint("(state = 'done') = (seq IS NOT NULL)", name=op.f("ck_tiles_seq_when_done")),
        sa.CheckConstraint("state IN ('waiting', 'running', 'done')", name=op.f("ck_tiles_state")),
        sa.ForeignKeyConstraint(
            ["render"], ["renders.number"], name=op.f("fk_tiles_render_renders"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("render", "pass_index", "tile", name=op.f("pk_tiles")),
    )
    op.create_index(
        "ix_tiles_waiting",
        "tiles",
        ["render", "pass_index", "tile"],
        sqlite_where=sa.text("state = 'waiting'"),
        postgresql_where=sa.text("state = 'waiting'"),
    )
    op.create_index("uq_tiles_render_seq", "tiles", ["render", "seq"], unique=True)


def _continue_numbers() -> None:
    """Go on counting after the rows that came with their numbers."""
    op.execute("SELECT setval(pg_get_serial_sequence('renders', 'number'), max(number)) FROM renders")
    op.execute("SELECT setval(pg_get_serial_sequence('jobs', 'number'), max(number)) FROM jobs")


def downgrade() -> None:
    """Undo."""
    raise NotImplementedError("Jobs that share a render fit in no earlier tables. Restore a backup.")
