"""Verification of everything that a service has stored, against the checksums in its database."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from sqlalchemy import select
from sqlalchemy.orm import Session

from schemas.api.jobs import JobState
from service.dispatch import adaptive_passes as adaptive
from service.dispatch import ledger
from service.jobs.damaged_files import IMAGE, is_encoding
from service.lifecycle import damage, rows
from service.storage.checking import checked, pieces
from service.storage.checksums import Expected, is_lost
from service.storage.database.connection import Database
from service.storage.database.models import AssetRow, RenderRow
from service.storage.folder import ASSETS, JOBS
from service.storage.objects import Objects
from service.storage.tiles import LAYERS_SUFFIX, SAMPLES_SUFFIX, SPEC, StoredTile, TileStore, tile_name
from service.workers import layers

MAX_LISTINGS = 2
"""Times that the files of a render are listed, as they come and go while it runs."""


@dataclass(frozen=True)
class Verified:
    """A stored file, by its name in the place; ``is_whole`` checks that it is undamaged."""

    name: str
    is_whole: bool


Reads = dict[str, Callable[[], object]]
"""Readers of the files of a render by name; each raises an error where its file is damaged."""


def verify(database: Database, place: Objects) -> Iterator[Verified]:
    """Read every file that the database refers to, and compare it with its checksum.

    Layers and encodings of pictures of version 0.1 have no checksum: that they are there is verified.
    """
    store = TileStore(place.within(JOBS))
    with database.reading() as session:
        renders = session.scalars(select(RenderRow.number).order_by(RenderRow.number)).all()
    for number in renders:
        yield from _render(database, store, number)
    assets = place.within(ASSETS)
    with database.reading() as session:
        known = session.scalars(select(AssetRow.sha256).order_by(AssetRow.sha256)).all()
    for sha256 in known:
        yield Verified(f"{ASSETS}/{sha256}", not is_lost(partial(_read, assets, sha256, sha256)))


def _read(place: Objects, name: str, expected: Expected) -> None:
    stored = place.find(name)
    if stored is None:
        raise FileNotFoundError(name)
    for _ in pieces(checked(name, stored, expected)):
        pass


def _render(database: Database, store: TileStore, number: int) -> Iterator[Verified]:
    """Verify the files of a render; lost ones are verified again by the database's newest state."""
    lost = None
    for _ in range(MAX_LISTINGS):
        with database.reading() as session:
            row = session.get(RenderRow, number)
            reads = {} if row is None else _reads(session, store, row)
        found = {name for name in (reads if lost is None else lost & reads.keys()) if is_lost(reads[name])}
        if lost is None:
            yield from (Verified(f"{JOBS}/{name}", True) for name in reads.keys() - found)
        lost = found
    yield from (Verified(f"{JOBS}/{name}", False) for name in sorted(lost or ()))


def _reads(session: Session, store: TileStore, render: RenderRow) -> Reads:
    try:
        with damage.using(render):
            name = f"{render.id}/{SPEC}"
            spec: Reads = {name: partial(_read, store.objects, name, render.spec_sha256)}
            if render.state is JobState.SUCCEEDED:
                return spec | _final(store, render)
            return spec if render.state.final else spec | _unfinished(session, store, render)
    except damage.DamagedRenderError as error:
        damage.note(render.id, error.__cause__)
        return {}


def _final(store: TileStore, render: RenderRow) -> Reads:
    prefix = render.final_prefix
    made = [file for file in render.encodings if store.find(render.id, f"{prefix}{file}")]
    files = [IMAGE, *map(layers.file_name, render.layers), *filter(is_encoding, made)]
    names = [f"{render.id}/{prefix}{file}" for file in files]
    return {
        name: partial(_read, store.objects, name, rows.expected(render, name.rpartition("/")[2]))
        for name in names
    }


def _unfinished(session: Session, store: TileStore, render: RenderRow) -> Reads:
    """Return what reads the tiles that are finished, and what merged passes have left for the next one."""
    job, reads = render.id, Reads()
    for name, checksum in rows.checksums_of(render).items():
        reads[f"{job}/{name}"] = partial(_read, store.objects, f"{job}/{name}", checksum)
    if render.target_error is None:
        parts = recorded = [*ledger.sampled(session, render)]
    else:
        parts, recorded = adaptive.fresh(session, render), adaptive.recorded(session, render)
        for part in parts:
            reads[f"{tile_name(job, part)}{SAMPLES_SUFFIX}"] = _reads_samples(store, job, part)
    for part in parts:
        reads[tile_name(job, part)] = partial(store.get_tile, job, part)
    for part in layers.recorded(recorded, render.layers):
        reads[f"{tile_name(job, part)}{LAYERS_SUFFIX}"] = _reads_layers(store, job, part)
    return reads


def _reads_samples(store: TileStore, job: str, part: StoredTile) -> Callable[[], object]:
    return lambda: next(store.get_samples(job, part.pass_.index, [part]))


def _reads_layers(store: TileStore, job: str, part: StoredTile) -> Callable[[], object]:
    return lambda: next(store.get_layers(job, [part]))
