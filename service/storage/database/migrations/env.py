"""Alembic's environment: runs migrations on the connection that the service passes."""

from __future__ import annotations

from alembic import context

from service.storage.database.models import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    render_as_batch=True,
)
context.run_migrations()
