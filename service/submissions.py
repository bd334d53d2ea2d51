"""Taking a job: its render with all its steps, entered in one transaction."""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

import structlog
from sqlalchemy import insert

from renderer import progressive, tiling
from service import pass_costs, rows, targets
from service.admission import Admitted
from service.context import Service
from service.database.models import JobRow, RenderRow, TileRow

log = structlog.get_logger()


def create(service: Service, admitted: Admitted, body: bytes) -> str:
    """Keep a job with all its steps, and return its id."""
    job_id = secrets.token_hex(8)
    steps, course = _course(admitted, service.settings.tile_size)
    render = _render(job_id, admitted, body, steps, course)
    job = _job(job_id, admitted)
    service.store.put_spec(render.id, body)
    try:
        with service.database.writing() as session:
            session.add(render)
            session.flush()
            job.render_number = render.number
            session.add(job)
            session.execute(
                insert(TileRow), [rows.new_step(render.number, pass_, tile) for pass_, tile in steps]
            )
    except BaseException:
        service.store.drop_job(render.id)
        raise
    service.dispatcher.wake()
    log.info("job queued", job=job_id, width=render.width, height=render.height, steps=len(steps))
    return job_id


def _job(job_id: str, admitted: Admitted) -> JobRow:
    return JobRow(
        id=job_id,
        name=admitted.request.scene.name,
        plan=admitted.description.model_dump(mode="json"),
        warnings=[warning.model_dump() for warning in admitted.warnings],
        predicted_cpu_seconds=admitted.description.cost.cpu_seconds,
        created_at=datetime.now(UTC),
    )


def _render(
    render_id: str, admitted: Admitted, spec: bytes, steps: list[targets.Step], course: dict[str, Any]
) -> RenderRow:
    plan = admitted.plan
    return RenderRow(
        id=render_id,
        width=plan.width,
        height=plan.height,
        spec_sha256=hashlib.sha256(spec).hexdigest(),
        passes=[asdict(pass_) for pass_ in dict.fromkeys(pass_ for pass_, _ in steps)],
        display=admitted.request.scene.display.model_dump(),
        layers=list(admitted.request.layers),
        total_steps=len(steps),
        predicted_cpu_seconds=admitted.description.cost.cpu_seconds,
        numerics=plan.numerics,
        **course,
    )


def _course(admitted: Admitted, tile_size: int | None) -> tuple[list[targets.Step], dict[str, Any]]:
    """The steps of a render, as far as they are known, and the columns that tell how it goes on."""
    plan, target = admitted.plan, admitted.target
    if target is not None:
        return targets.begin(plan, target, tile_size, admitted.description.cost.camera_rays)
    steps = [(pass_, tile) for pass_ in plan.passes for tile in tiling.tiles(plan, pass_, tile_size)]
    return steps, {
        "total_work": sum(rows.work(pass_, tile) for pass_, tile in steps),
        "pass_costs": pass_costs.begin([pass_.index for pass_, _ in steps]),
        "error_unknown": progressive.unknown_error(plan),
    }
