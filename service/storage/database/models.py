"""Tables. Portable between SQLite and PostgreSQL; the migrations build exactly these."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    Enum,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Text,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship

from schemas.api.jobs import JobState
from service.storage.database import conditions
from service.storage.database.columns import COUNT, UtcDateTime

WAITING, RUNNING, DONE = "waiting", "running", "done"

STATE = Enum(JobState, native_enum=False, length=16, values_callable=lambda states: [s.value for s in states])


class Base(DeclarativeBase):
    """Names every constraint, so that a later migration can name it too."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
            "pk": "pk_%(table_name)s",
        }
    )


def _one_of(column: str, values: list[str]) -> str:
    return f"{column} IN ({', '.join(repr(value) for value in values)})"


SHAREABLE = "state IN ('queued', 'running', 'succeeded') AND NOT cancel_requested"
"""Condition of renders that new jobs may share; failed ones are rendered again."""


# All that places are counted from, in order: the index is read in place of the rows.
_QUEUE = "state", "owner", text("priority DESC"), "number", "render_number", "coarse_cpu_seconds", "paused_at"


def _partial(name: str, *columns: Any, where: str, unique: bool = False) -> Index:
    """Make an index of the rows that fulfil a condition; a statement that uses it must have the condition.

    It is the same on PostgreSQL, where migrations write it. Written here it would import that dialect.
    """
    return Index(name, *columns, unique=unique, sqlite_where=text(where))


class RenderRow(Base):
    """Render: one piece of work, shared by equal jobs.

    Those of the same ``spec_sha256`` and ``version`` of the renderer show the same; without a version one is
    never shared. ``number`` orders them by arrival; ``id`` is its name in the store, that of the job it was
    made for. One with a ``target_error`` gets its passes one after another: ``merges`` has an entry for each
    pass whose tiles are merged into the picture, the work before it being ``counted_work`` and
    ``counted_share`` of all. Any other has an entry for each of its passes in ``pass_costs``, and where these
    cannot estimate the error of the picture, the reason in ``error_unknown``. ``focus`` is a rectangle to
    render first. While it is paused it has ``paused_at``; ``paused_seconds`` are those of earlier pauses.
    ``traceparent`` is the span of the request that it came with, where spans are collected.

    ``compose_attempt`` numbers the tasks that put its tiles together; no number is given twice, so that each
    writes files of its own. ``compose_deaths`` are the workers that this has cost since the last merged pass.
    The names of the final picture, its layers and its encodings in the store begin with ``final_prefix``; it
    is empty for pictures of version 0.1.

    ``stored_bytes`` are those of its request and of its final files, among them the ``encodings`` that were
    made of the picture so far, by their names; None if an earlier version has counted nothing. A picture
    of which no job is pinned has ``idle_since``, when the last of its jobs has ended: the oldest go first
    where there are too many bytes.

    ``checksums`` are those of the files whose bytes count now, by their names in the store: of the final
    picture, its layers and encodings, and before that of what the newest merged passes have left. Pictures of
    version 0.1 have none. Where a file of the final picture was found to be damaged, ``damage`` is its name;
    such a picture has lost its version, and is not shared. ``damage_count`` counts how often files of a
    running render were.
    """

    __tablename__ = "renders"
    __table_args__ = (
        CheckConstraint(_one_of("state", [state.value for state in JobState]), name="state"),
        Index("ix_renders_state_number", "state", "number"),
        _partial("ix_renders_idle", "idle_since", "number", where="idle_since IS NOT NULL"),
        # Those with a state begin with it: SQLite would prefer the index of all renders in that state.
        _partial("ix_renders_unmeasured", "state", "stored_bytes", "number", where=conditions.UNMEASURED),
        _partial("ix_renders_with_error", "number", where=conditions.WITH_ERROR),
        # Only one of equal renders may be joined.
        _partial("uq_renders_spec_sha256", "spec_sha256", "version", unique=True, where=SHAREABLE),
        {"sqlite_autoincrement": True},  # the number of one that is gone is never given again
    )

    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(32), unique=True)
    state: Mapped[JobState] = mapped_column(STATE, default=JobState.QUEUED)
    cancel_requested: Mapped[bool] = mapped_column(default=False)

    width: Mapped[int] = mapped_column(Integer)
    height: Mapped[int] = mapped_column(Integer)
    spec_sha256: Mapped[str] = mapped_column(String(64))
    version: Mapped[str | None] = mapped_column(String(32))
    passes: Mapped[list[dict[str, int]]] = mapped_column(JSON)
    display: Mapped[dict[str, Any]] = mapped_column(JSON)
    layers: Mapped[list[str]] = mapped_column(JSON, default=list)

    total_steps: Mapped[int] = mapped_column(Integer)
    done_steps: Mapped[int] = mapped_column(Integer, default=0)
    total_work: Mapped[int] = mapped_column(COUNT)
    done_work: Mapped[int] = mapped_column(COUNT, default=0)
    last_seq: Mapped[int] = mapped_column(Integer, default=0)
    compose_attempt: Mapped[int] = mapped_column(Integer, default=0)
    compose_deaths: Mapped[int] = mapped_column(Integer, default=0, server_default="0")

    predicted_cpu_seconds: Mapped[float] = mapped_column(Float)
    cpu_seconds: Mapped[float] = mapped_column(Float, default=0.0)
    rays: Mapped[dict[str, int]] = mapped_column(JSON, default=dict)
    work: Mapped[dict[str, int]] = mapped_column(JSON, default=dict)
    numerics: Mapped[dict[str, int]] = mapped_column(JSON, default=dict)

    target_error: Mapped[float | None] = mapped_column(Float)
    time_limit: Mapped[float | None] = mapped_column(Float)
    tile_size: Mapped[int | None] = mapped_column(Integer)
    merges: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list)
    counted_share: Mapped[float] = mapped_column(Float, default=0.0)
    counted_work: Mapped[int] = mapped_column(COUNT, default=0)

    pass_costs: Mapped[list[dict[str, Any]]] = mapped_column(JSON, default=list)
    error_unknown: Mapped[str | None] = mapped_column(Text)

    traceparent: Mapped[str | None] = mapped_column(String(55))
    image_sha256: Mapped[str | None] = mapped_column(String(64))
    final_prefix: Mapped[str] = mapped_column(String(16), default="", server_default="")
    stored_bytes: Mapped[int | None] = mapped_column(COUNT)
    encodings: Mapped[list[str]] = mapped_column(JSON, default=list, server_default="[]")
    idle_since: Mapped[datetime | None] = mapped_column(UtcDateTime)
    checksums: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    damage: Mapped[str | None] = mapped_column(Text)
    damage_count: Mapped[int] = mapped_column(Integer, default=0, server_default="0")
    focus: Mapped[dict[str, int] | None] = mapped_column(JSON(none_as_null=True))
    started_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    paused_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    paused_seconds: Mapped[float] = mapped_column(Float, default=0.0)


class JobRow(Base):
    """Job: a request of a user.

    ``number`` orders jobs by arrival; ``id`` is the name that the outside knows. While it shares in a render
    its state is that of the render. One that has left before the others, or whose picture is gone, has none,
    and keeps in ``parting`` what is still reported of it. ``load`` is what it counts in the queue, in CPU
    seconds; nothing if it shares what another counts, who passes it on when it leaves. After
    ``coarse_cpu_seconds``, those of its coarse picture, the next job of its owner starts. ``paused_at`` and
    ``paused_seconds`` are as in a render. One that is ``pinned`` keeps its picture until it is deleted.
    """

    __tablename__ = "jobs"
    __table_args__ = (
        CheckConstraint(_one_of("state", [state.value for state in JobState]), name="state"),
        Index("ix_jobs_state_number", "state", "number"),
        Index("ix_jobs_render_number", "render_number"),
        Index("ix_jobs_owner_number", "owner", "number"),
        Index("ix_jobs_owner_state", "owner", "state", "number"),
        _partial("ix_jobs_open", "owner", "load", where="finished_at IS NULL"),
        _partial("ix_jobs_pinned", "owner", where="pinned"),
        _partial("ix_jobs_with_picture", "state", "finished_at", "number", where=conditions.HAS_PICTURE),
        _partial("ix_jobs_finished_at", "finished_at", "number", where=conditions.MAY_BE_FORGOTTEN),
        _partial("ix_jobs_queue", *_QUEUE, where=conditions.WAITS_TO_START),
        {"sqlite_autoincrement": True},  # the number of a deleted job is never given again
    )

    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(32), unique=True)
    owner: Mapped[str] = mapped_column(String(64))
    name: Mapped[str | None] = mapped_column(Text)
    labels: Mapped[dict[str, str]] = mapped_column(JSON, default=dict)
    priority: Mapped[int] = mapped_column(Integer, default=0)
    time_limit: Mapped[float | None] = mapped_column(Float)
    quality: Mapped[dict[str, Any]] = mapped_column(JSON)
    state: Mapped[JobState] = mapped_column(STATE, default=JobState.QUEUED)
    render_number: Mapped[int | None] = mapped_column(ForeignKey("renders.number"))
    parting: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))

    plan: Mapped[dict[str, Any]] = mapped_column(JSON, deferred=True)
    warnings: Mapped[list[dict[str, Any]]] = mapped_column(JSON)
    predicted_cpu_seconds: Mapped[float] = mapped_column(Float)
    load: Mapped[float] = mapped_column(Float, default=0.0)
    coarse_cpu_seconds: Mapped[float] = mapped_column(Float, default=0.0, server_default="0")
    pinned: Mapped[bool] = mapped_column(default=False)

    failure: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    started_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    finished_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    paused_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    paused_seconds: Mapped[float] = mapped_column(Float, default=0.0)

    render: Mapped[RenderRow | None] = relationship(lazy="joined")


class LabelRow(Base):
    """A label of a job, once more, to find the job by: among all jobs, or among those of its owner."""

    __tablename__ = "labels"
    __table_args__ = (
        Index("ix_labels_name", "name", "value", "job"),
        Index("ix_labels_owner", "owner", "name", "value", "job"),
    )

    job: Mapped[int] = mapped_column(ForeignKey("jobs.number", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(String(63), primary_key=True)
    value: Mapped[str] = mapped_column(String(200))
    owner: Mapped[str] = mapped_column(String(64), server_default="")


class RequestRow(Base):
    """The body of the request that a job came with, compressed."""

    __tablename__ = "requests"

    job: Mapped[int] = mapped_column(ForeignKey("jobs.number", ondelete="CASCADE"), primary_key=True)
    body: Mapped[bytes] = mapped_column(LargeBinary)


class ShareRow(Base):
    """Rendering time charged to a user, in CPU seconds as ``fairness.py`` counts them.

    ``turn`` is what it was when the user was served last; ``active`` says that steps of the user may wait.
    ``served`` is a clock, which jumps forward after a pause; ``charged`` is the sum without the jumps.
    """

    __tablename__ = "shares"
    __table_args__ = (
        Index("ix_shares_active", "active", "served", "owner"),
        Index("ix_shares_turn", "turn"),
    )

    owner: Mapped[str] = mapped_column(String(64), primary_key=True)
    served: Mapped[float] = mapped_column(Float)
    turn: Mapped[float] = mapped_column(Float)
    active: Mapped[bool] = mapped_column()
    charged: Mapped[float] = mapped_column(Float, default=0.0, server_default="0")


class IdempotencyRow(Base):
    """An ``Idempotency-Key`` of a user, the request that it came with, and the job that came of it."""

    __tablename__ = "idempotency_keys"
    __table_args__ = (
        Index("ix_idempotency_keys_job", "job"),
        Index("ix_idempotency_keys_created_at", "created_at"),
    )

    owner: Mapped[str] = mapped_column(String(64), primary_key=True)
    key: Mapped[str] = mapped_column(String(255), primary_key=True)
    body_sha256: Mapped[str] = mapped_column(String(64))
    job: Mapped[int] = mapped_column(ForeignKey("jobs.number", ondelete="CASCADE"))
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)


class TileRow(Base):
    """One step of a render: a tile in a pass.

    A finished step has a number of its own in its render (``seq``): the finished rows in this order are
    the events of its jobs, so that an event and its tile can never disagree.
    """

    __tablename__ = "tiles"
    __table_args__ = (
        CheckConstraint(_one_of("state", [WAITING, RUNNING, DONE]), name="state"),
        CheckConstraint("(state = 'done') = (seq IS NOT NULL)", name="seq_when_done"),
        Index("uq_tiles_render_seq", "render", "seq", unique=True),
        _partial("ix_tiles_waiting", "render", "pass_index", "tile", where="state = 'waiting'"),
        _partial("ix_tiles_running", "render", where="state = 'running'"),
    )

    render: Mapped[int] = mapped_column(ForeignKey("renders.number", ondelete="CASCADE"), primary_key=True)
    pass_index: Mapped[int] = mapped_column(Integer, primary_key=True)
    tile: Mapped[int] = mapped_column(Integer, primary_key=True)
    x0: Mapped[int] = mapped_column(Integer)
    y0: Mapped[int] = mapped_column(Integer)
    x1: Mapped[int] = mapped_column(Integer)
    y1: Mapped[int] = mapped_column(Integer)
    state: Mapped[str] = mapped_column(String(8), default=WAITING)
    attempt: Mapped[int] = mapped_column(Integer, default=0)
    deaths: Mapped[int] = mapped_column(Integer, default=0)
    seq: Mapped[int | None] = mapped_column(Integer)
    crc32: Mapped[int | None] = mapped_column(BigInteger)
    cpu_seconds: Mapped[float | None] = mapped_column(Float)
    payer: Mapped[str | None] = mapped_column(String(64))
    charge: Mapped[float] = mapped_column(Float, default=0.0)


class LeaderRow(Base):
    """The server that hands out work, where several use this database; one row.

    ``term`` counts how often another one has begun to; the time of ``expires_at`` is that of the database's
    clock. ``folder`` is the name that the data folder bears which belongs to this database; before that is
    written, ``?`` precedes it.
    """

    __tablename__ = "leader"

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=False)
    term: Mapped[int] = mapped_column(Integer)
    server: Mapped[str | None] = mapped_column(String(32))
    expires_at: Mapped[datetime] = mapped_column(UtcDateTime)
    folder: Mapped[str | None] = mapped_column(String(32))


class KeyRow(Base):
    """An API key: a name that may be shown, and the digest of a secret."""

    __tablename__ = "api_keys"

    id: Mapped[str] = mapped_column(String(12), primary_key=True)
    secret_sha256: Mapped[str] = mapped_column(String(64))
    user: Mapped[str] = mapped_column(String(64))
    role: Mapped[str] = mapped_column(String(8))
    max_jobs: Mapped[int | None] = mapped_column(Integer)
    max_cpu_seconds: Mapped[float | None] = mapped_column(Float)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    revoked_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    expires_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    last_used_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class SessionRow(Base):
    """A browser that has shown a key, by the digest of its cookie."""

    __tablename__ = "sessions"

    token_sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    key: Mapped[str] = mapped_column(ForeignKey("api_keys.id", ondelete="CASCADE"))
    expires_at: Mapped[datetime] = mapped_column(UtcDateTime)


class AssetUseRow(Base):
    """An asset that a render needs."""

    __tablename__ = "asset_uses"
    __table_args__ = (Index("ix_asset_uses_sha256", "sha256"),)

    render: Mapped[int] = mapped_column(ForeignKey("renders.number", ondelete="CASCADE"), primary_key=True)
    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)


class AssetRow(Base):
    """An uploaded texture or mesh. Its bytes are in the store under the same name.

    ``used_at`` is when it was last sent or requested, and ``renders`` counts those that need it.
    """

    __tablename__ = "assets"
    __table_args__ = (_partial("ix_assets_unused", "used_at", where="renders = 0"),)

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    bytes: Mapped[int] = mapped_column(COUNT)
    media_type: Mapped[str] = mapped_column(String(64))
    width: Mapped[int] = mapped_column(Integer)
    height: Mapped[int] = mapped_column(Integer)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    used_at: Mapped[datetime] = mapped_column(UtcDateTime)
    renders: Mapped[int] = mapped_column(Integer, default=0, server_default="0")


class AssetOwnerRow(Base):
    """A user who has uploaded an asset: to all others it is not there."""

    __tablename__ = "asset_owners"
    __table_args__ = (Index("ix_asset_owners_sha256", "sha256"),)

    owner: Mapped[str] = mapped_column(String(64), primary_key=True)
    sha256: Mapped[str] = mapped_column(ForeignKey("assets.sha256", ondelete="CASCADE"), primary_key=True)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)


class TotalRow(Base):
    """A sum over all that is kept, so that no statement has to add it up; ``totals.py`` has the names."""

    __tablename__ = "totals"

    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    amount: Mapped[int] = mapped_column(COUNT)
