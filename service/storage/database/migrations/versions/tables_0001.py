"""The tables of the first release."""

from __future__ import annotations

from datetime import UTC, datetime

import sqlalchemy as sa
from alembic import op

revision = "tables_0001"
down_revision = None
branch_labels = None
depends_on = None

COUNT = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
MOMENT = sa.DateTime(timezone=True)
STATES = "state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled', 'expired')"
JOINED = sa.text("state IN ('queued', 'running', 'succeeded') AND NOT cancel_requested")
OPEN = sa.text("finished_at IS NULL")
WAITING = sa.text("state = 'waiting'")
RUNNING = sa.text("state = 'running'")


def upgrade() -> None:
    """Apply."""
    op.create_table(
        "renders",
        sa.Column("number", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("state", sa.String(length=16), nullable=False),
        sa.Column("cancel_requested", sa.Boolean(), nullable=False),
        sa.Column("width", sa.Integer(), nullable=False),
        sa.Column("height", sa.Integer(), nullable=False),
        sa.Column("spec_sha256", sa.String(length=64), nullable=False),
        sa.Column("version", sa.String(length=32), nullable=True),
        sa.Column("passes", sa.JSON(), nullable=False),
        sa.Column("display", sa.JSON(), nullable=False),
        sa.Column("layers", sa.JSON(), nullable=False),
        sa.Column("total_steps", sa.Integer(), nullable=False),
        sa.Column("done_steps", sa.Integer(), nullable=False),
        sa.Column("total_work", COUNT, nullable=False),
        sa.Column("done_work", COUNT, nullable=False),
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
        sa.Column("counted_work", COUNT, nullable=False),
        sa.Column("pass_costs", sa.JSON(), nullable=False),
        sa.Column("error_unknown", sa.Text(), nullable=True),
        sa.Column("traceparent", sa.String(length=55), nullable=True),
        sa.Column("image_sha256", sa.String(length=64), nullable=True),
        sa.Column("focus", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("started_at", MOMENT, nullable=True),
        sa.Column("paused_at", MOMENT, nullable=True),
        sa.Column("paused_seconds", sa.Float(), nullable=False),
        sa.CheckConstraint(STATES, name=op.f("ck_renders_state")),
        sa.PrimaryKeyConstraint("number", name=op.f("pk_renders")),
        sa.UniqueConstraint("id", name=op.f("uq_renders_id")),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_renders_state_number", "renders", ["state", "number"])
    op.create_index(
        "uq_renders_spec_sha256",
        "renders",
        ["spec_sha256", "version"],
        unique=True,
        sqlite_where=JOINED,
        postgresql_where=JOINED,
    )
    op.create_table(
        "jobs",
        sa.Column("number", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("name", sa.Text(), nullable=True),
        sa.Column("labels", sa.JSON(), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("time_limit", sa.Float(), nullable=True),
        sa.Column("quality", sa.JSON(), nullable=False),
        sa.Column("state", sa.String(length=16), nullable=False),
        sa.Column("render_number", sa.Integer(), nullable=True),
        sa.Column("parting", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("plan", sa.JSON(), nullable=False),
        sa.Column("warnings", sa.JSON(), nullable=False),
        sa.Column("predicted_cpu_seconds", sa.Float(), nullable=False),
        sa.Column("load", sa.Float(), nullable=False),
        sa.Column("pinned", sa.Boolean(), nullable=False),
        sa.Column("failure", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("started_at", MOMENT, nullable=True),
        sa.Column("finished_at", MOMENT, nullable=True),
        sa.Column("paused_at", MOMENT, nullable=True),
        sa.Column("paused_seconds", sa.Float(), nullable=False),
        sa.CheckConstraint(STATES, name=op.f("ck_jobs_state")),
        sa.ForeignKeyConstraint(
            ["render_number"], ["renders.number"], name=op.f("fk_jobs_render_number_renders")
        ),
        sa.PrimaryKeyConstraint("number", name=op.f("pk_jobs")),
        sa.UniqueConstraint("id", name=op.f("uq_jobs_id")),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_jobs_finished_at", "jobs", ["finished_at"])
    op.create_index("ix_jobs_open", "jobs", ["owner", "load"], sqlite_where=OPEN, postgresql_where=OPEN)
    op.create_index("ix_jobs_owner_number", "jobs", ["owner", "number"])
    op.create_index("ix_jobs_render_number", "jobs", ["render_number"])
    op.create_index("ix_jobs_state_number", "jobs", ["state", "number"])
    op.create_table(
        "labels",
        sa.Column("job", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=63), nullable=False),
        sa.Column("value", sa.String(length=200), nullable=False),
        sa.ForeignKeyConstraint(
            ["job"], ["jobs.number"], name=op.f("fk_labels_job_jobs"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job", "name", name=op.f("pk_labels")),
    )
    op.create_index("ix_labels_name", "labels", ["name", "value", "job"])
    op.create_table(
        "requests",
        sa.Column("job", sa.Integer(), nullable=False),
        sa.Column("body", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["job"], ["jobs.number"], name=op.f("fk_requests_job_jobs"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("job", name=op.f("pk_requests")),
    )
    op.create_table(
        "shares",
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("served", sa.Float(), nullable=False),
        sa.Column("turn", sa.Float(), nullable=False),
        sa.Column("active", sa.Boolean(), nullable=False),
        sa.PrimaryKeyConstraint("owner", name=op.f("pk_shares")),
    )
    op.create_index("ix_shares_active", "shares", ["active", "served", "owner"])
    op.create_index("ix_shares_turn", "shares", ["turn"])
    op.create_table(
        "idempotency_keys",
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("key", sa.String(length=255), nullable=False),
        sa.Column("body_sha256", sa.String(length=64), nullable=False),
        sa.Column("job", sa.Integer(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(
            ["job"], ["jobs.number"], name=op.f("fk_idempotency_keys_job_jobs"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("owner", "key", name=op.f("pk_idempotency_keys")),
    )
    op.create_index("ix_idempotency_keys_job", "idempotency_keys", ["job"])
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
        sa.Column("payer", sa.String(length=64), nullable=True),
        sa.Column("charge", sa.Float(), nullable=False),
        sa.CheckConstraint("(state = 'done') = (seq IS NOT NULL)", name=op.f("ck_tiles_seq_when_done")),
        sa.CheckConstraint("state IN ('waiting', 'running', 'done')", name=op.f("ck_tiles_state")),
        sa.ForeignKeyConstraint(
            ["render"], ["renders.number"], name=op.f("fk_tiles_render_renders"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("render", "pass_index", "tile", name=op.f("pk_tiles")),
    )
    op.create_index("ix_tiles_running", "tiles", ["render"], sqlite_where=RUNNING, postgresql_where=RUNNING)
    op.create_index(
        "ix_tiles_waiting",
        "tiles",
        ["render", "pass_index", "tile"],
        sqlite_where=WAITING,
        postgresql_where=WAITING,
    )
    op.create_index("uq_tiles_render_seq", "tiles", ["render", "seq"], unique=True)
    leader = op.create_table(
        "leader",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("term", sa.Integer(), nullable=False),
        sa.Column("server", sa.String(length=32), nullable=True),
        sa.Column("expires_at", MOMENT, nullable=False),
        sa.Column("folder", sa.String(length=32), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_leader")),
    )
    # Nobody leads yet.
    op.bulk_insert(leader, [{"id": 1, "term": 0, "expires_at": datetime.now(UTC)}])
    op.create_table(
        "api_keys",
        sa.Column("id", sa.String(length=12), nullable=False),
        sa.Column("secret_sha256", sa.String(length=64), nullable=False),
        sa.Column("user", sa.String(length=64), nullable=False),
        sa.Column("role", sa.String(length=8), nullable=False),
        sa.Column("max_jobs", sa.Integer(), nullable=True),
        sa.Column("max_cpu_seconds", sa.Float(), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("revoked_at", MOMENT, nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_api_keys")),
    )
    op.create_table(
        "sessions",
        sa.Column("token_sha256", sa.String(length=64), nullable=False),
        sa.Column("key", sa.String(length=12), nullable=False),
        sa.Column("expires_at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(
            ["key"], ["api_keys.id"], name=op.f("fk_sessions_key_api_keys"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("token_sha256", name=op.f("pk_sessions")),
    )
    op.create_table(
        "asset_uses",
        sa.Column("render", sa.Integer(), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.ForeignKeyConstraint(
            ["render"], ["renders.number"], name=op.f("fk_asset_uses_render_renders"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("render", "sha256", name=op.f("pk_asset_uses")),
    )
    op.create_index("ix_asset_uses_sha256", "asset_uses", ["sha256"])
    op.create_table(
        "assets",
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("bytes", COUNT, nullable=False),
        sa.Column("media_type", sa.String(length=64), nullable=False),
        sa.Column("width", sa.Integer(), nullable=False),
        sa.Column("height", sa.Integer(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("used_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("sha256", name=op.f("pk_assets")),
    )
    op.create_table(
        "asset_owners",
        sa.Column("owner", sa.String(length=64), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(
            ["sha256"], ["assets.sha256"], name=op.f("fk_asset_owners_sha256_assets"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("owner", "sha256", name=op.f("pk_asset_owners")),
    )
    op.create_index("ix_asset_owners_sha256", "asset_owners", ["sha256"])
