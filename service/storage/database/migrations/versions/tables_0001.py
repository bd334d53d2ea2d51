"""The tables of the first release, frozen: later versions of ``models.py`` change nothing here."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "tables_0001"
down_revision = None
branch_labels = None
depends_on = None

COUNT = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
TIME = sa.DateTime(timezone=True)
DOCUMENT = sa.JSON(none_as_null=True)
ID, NAME, DIGEST = sa.String(32), sa.String(64), sa.String(64)
STATES = "state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled', 'expired')"

METADATA = sa.MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)


def column(name: str, kind: Any) -> sa.Column[Any]:
    """Make a column that always has a value."""
    return sa.Column(name, kind, nullable=False)


def partial_index(name: str, *columns: str, where: str, unique: bool = False) -> sa.Index:
    """Make an index of the rows that satisfy a condition."""
    condition = sa.text(where)
    return sa.Index(name, *columns, unique=unique, sqlite_where=condition, postgresql_where=condition)


def part_of(table: str) -> sa.ForeignKey:
    """Refer to a row, with which this one is deleted."""
    return sa.ForeignKey(table, ondelete="CASCADE")


sa.Table(
    "renders",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", ID, nullable=False, unique=True),
    column("state", sa.String(16)),
    column("cancel_requested", sa.Boolean),
    column("width", sa.Integer),
    column("height", sa.Integer),
    column("spec_sha256", DIGEST),
    sa.Column("version", sa.String(32)),
    column("passes", sa.JSON),
    column("display", sa.JSON),
    column("layers", sa.JSON),
    column("total_steps", sa.Integer),
    column("done_steps", sa.Integer),
    column("total_work", COUNT),
    column("done_work", COUNT),
    column("last_seq", sa.Integer),
    column("compose_attempt", sa.Integer),
    column("predicted_cpu_seconds", sa.Float),
    column("cpu_seconds", sa.Float),
    column("rays", sa.JSON),
    column("work", sa.JSON),
    column("numerics", sa.JSON),
    sa.Column("target_error", sa.Float),
    sa.Column("time_limit", sa.Float),
    sa.Column("tile_size", sa.Integer),
    column("merges", sa.JSON),
    column("counted_share", sa.Float),
    column("counted_work", COUNT),
    column("pass_costs", sa.JSON),
    sa.Column("error_unknown", sa.Text),
    sa.Column("traceparent", sa.String(55)),
    sa.Column("image_sha256", DIGEST),
    sa.Column("focus", DOCUMENT),
    sa.Column("started_at", TIME),
    sa.Column("paused_at", TIME),
    column("paused_seconds", sa.Float),
    sa.CheckConstraint(STATES, name="state"),
    sa.Index("ix_renders_state_number", "state", "number"),
    partial_index(
        "uq_renders_spec_sha256",
        "spec_sha256",
        "version",
        where="state IN ('queued', 'running', 'succeeded') AND NOT cancel_requested",
        unique=True,
    ),
    sqlite_autoincrement=True,
)

sa.Table(
    "jobs",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", ID, nullable=False, unique=True),
    column("owner", NAME),
    sa.Column("name", sa.Text),
    column("labels", sa.JSON),
    column("priority", sa.Integer),
    sa.Column("time_limit", sa.Float),
    column("quality", sa.JSON),
    column("state", sa.String(16)),
    sa.Column("render_number", sa.Integer, sa.ForeignKey("renders.number")),
    sa.Column("parting", DOCUMENT),
    column("plan", sa.JSON),
    column("warnings", sa.JSON),
    column("predicted_cpu_seconds", sa.Float),
    column("load", sa.Float),
    column("pinned", sa.Boolean),
    sa.Column("failure", DOCUMENT),
    column("created_at", TIME),
    sa.Column("started_at", TIME),
    sa.Column("finished_at", TIME),
    sa.Column("paused_at", TIME),
    column("paused_seconds", sa.Float),
    sa.CheckConstraint(STATES, name="state"),
    sa.Index("ix_jobs_finished_at", "finished_at"),
    partial_index("ix_jobs_open", "owner", "load", where="finished_at IS NULL"),
    sa.Index("ix_jobs_owner_number", "owner", "number"),
    sa.Index("ix_jobs_render_number", "render_number"),
    sa.Index("ix_jobs_state_number", "state", "number"),
    sqlite_autoincrement=True,
)

sa.Table(
    "labels",
    METADATA,
    sa.Column("job", sa.Integer, part_of("jobs.number"), primary_key=True),
    sa.Column("name", sa.String(63), primary_key=True),
    column("value", sa.String(200)),
    sa.Index("ix_labels_name", "name", "value", "job"),
)

sa.Table(
    "requests",
    METADATA,
    sa.Column("job", sa.Integer, part_of("jobs.number"), primary_key=True, autoincrement=False),
    column("body", sa.LargeBinary),
)

sa.Table(
    "shares",
    METADATA,
    sa.Column("owner", NAME, primary_key=True),
    column("served", sa.Float),
    column("turn", sa.Float),
    column("active", sa.Boolean),
    sa.Index("ix_shares_active", "active", "served", "owner"),
    sa.Index("ix_shares_turn", "turn"),
)

sa.Table(
    "idempotency_keys",
    METADATA,
    sa.Column("owner", NAME, primary_key=True),
    sa.Column("key", sa.String(255), primary_key=True),
    column("body_sha256", DIGEST),
    sa.Column("job", sa.Integer, part_of("jobs.number"), nullable=False),
    column("created_at", TIME),
    sa.Index("ix_idempotency_keys_job", "job"),
)

sa.Table(
    "tiles",
    METADATA,
    sa.Column("render", sa.Integer, part_of("renders.number"), primary_key=True),
    sa.Column("pass_index", sa.Integer, primary_key=True),
    sa.Column("tile", sa.Integer, primary_key=True),
    column("x0", sa.Integer),
    column("y0", sa.Integer),
    column("x1", sa.Integer),
    column("y1", sa.Integer),
    column("state", sa.String(8)),
    column("attempt", sa.Integer),
    column("deaths", sa.Integer),
    sa.Column("seq", sa.Integer),
    sa.Column("crc32", sa.BigInteger),
    sa.Column("cpu_seconds", sa.Float),
    sa.Column("payer", NAME),
    column("charge", sa.Float),
    sa.CheckConstraint("(state = 'done') = (seq IS NOT NULL)", name="seq_when_done"),
    sa.CheckConstraint("state IN ('waiting', 'running', 'done')", name="state"),
    partial_index("ix_tiles_running", "render", where="state = 'running'"),
    partial_index("ix_tiles_waiting", "render", "pass_index", "tile", where="state = 'waiting'"),
    sa.Index("uq_tiles_render_seq", "render", "seq", unique=True),
)

LEADER = sa.Table(
    "leader",
    METADATA,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    column("term", sa.Integer),
    sa.Column("server", sa.String(32)),
    column("expires_at", TIME),
    sa.Column("folder", sa.String(32)),
)

sa.Table(
    "api_keys",
    METADATA,
    sa.Column("id", sa.String(12), primary_key=True),
    column("secret_sha256", DIGEST),
    column("user", NAME),
    column("role", sa.String(8)),
    sa.Column("max_jobs", sa.Integer),
    sa.Column("max_cpu_seconds", sa.Float),
    column("created_at", TIME),
    sa.Column("revoked_at", TIME),
)

sa.Table(
    "sessions",
    METADATA,
    sa.Column("token_sha256", DIGEST, primary_key=True),
    sa.Column("key", sa.String(12), part_of("api_keys.id"), nullable=False),
    column("expires_at", TIME),
)

sa.Table(
    "asset_uses",
    METADATA,
    sa.Column("render", sa.Integer, part_of("renders.number"), primary_key=True),
    sa.Column("sha256", DIGEST, primary_key=True),
    sa.Index("ix_asset_uses_sha256", "sha256"),
)

sa.Table(
    "assets",
    METADATA,
    sa.Column("sha256", DIGEST, primary_key=True),
    column("bytes", COUNT),
    column("media_type", sa.String(64)),
    column("width", sa.Integer),
    column("height", sa.Integer),
    column("created_at", TIME),
    column("used_at", TIME),
)

sa.Table(
    "asset_owners",
    METADATA,
    sa.Column("owner", NAME, primary_key=True),
    sa.Column("sha256", DIGEST, part_of("assets.sha256"), primary_key=True),
    column("created_at", TIME),
    sa.Index("ix_asset_owners_sha256", "sha256"),
)


def upgrade() -> None:
    """Create all tables; no server leads yet."""
    METADATA.create_all(op.get_bind(), checkfirst=False)
    op.bulk_insert(LEADER, [{"id": 1, "term": 0, "expires_at": datetime.now(UTC)}])
