"""Disks and databases that cannot be written, and tiles that are read while they are written."""

from __future__ import annotations

import multiprocessing
import resource
import sqlite3
import time
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx2
import numpy as np

from benchmarks.chaos.ground import LONGEST, ended, image, picture, settings, submit
from benchmarks.load.processes import workers_of
from benchmarks.load.promises import Promise
from schemas.tiles import Pass, Tile
from service.server import running
from service.storage.folder import Folder
from service.storage.tiles import StoredTile, TileStore

SIDE = 32
# Each pass is read so often, lest the disk fill with passes.
READS_OF_EACH = 20


def disk_full(expected: list[bytes], seconds: float = 3.0) -> Promise:
    """Let no process of the service write to any file for a while, as on a full disk."""
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder))) as server,
        httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
    ):
        sent = [submit(client, picture(number)) for number in range(len(expected))]
        client.get(f"/v1/jobs/{sent[0]}/tiles", params={"after": 0, "wait": 30})
        processes = [server.process.pid, *workers_of(server.process.pid)]
        for process in processes:
            _limit_files(process, 0)
        refused = client.post("/v1/jobs", json={"scene": picture(99)})
        time.sleep(seconds)
        states = {client.get(f"/v1/jobs/{job}").json()["state"] for job in sent}
        for process in [server.process.pid, *workers_of(server.process.pid)]:
            _limit_files(process, resource.RLIM_INFINITY)
        same = sum(image(client, ended(client, job)["id"]) == expected[n] for n, job in enumerate(sent))
    answered = refused.status_code in (503, 507) and "Retry-After" in refused.headers
    return Promise(
        promise="while the disk is full jobs wait and resume afterwards",
        measured=f"answered {refused.status_code}, {same} of {len(sent)} pictures the same afterwards",
        held=answered and same == len(sent) and "failed" not in states,
        limit="503 or 507 with Retry-After, none fails, all the same",
        details={"status": refused.status_code, "states": sorted(states), "same": same},
    )


def _limit_files(process: int, size: int) -> None:
    _, hard = resource.prlimit(process, resource.RLIMIT_FSIZE)
    resource.prlimit(process, resource.RLIMIT_FSIZE, (size, hard))


def database_locked(expected: list[bytes], seconds: float = 12.0) -> Promise:
    """Hold the database's lock in another process's place for a while."""
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder))) as server,
        httpx2.Client(base_url=server.url, timeout=LONGEST) as client,
    ):
        sent = [submit(client, picture(number)) for number in range(len(expected))]
        with closing(sqlite3.connect(Path(folder) / "penumbra.sqlite", isolation_level=None)) as other:
            other.execute("PRAGMA busy_timeout = 10000")
            other.execute("BEGIN IMMEDIATE")
            begun = time.monotonic()
            refused = client.post("/v1/jobs", json={"scene": picture(99)})
            read = client.get(f"/v1/jobs/{sent[0]}").status_code
            time.sleep(max(0.0, seconds - (time.monotonic() - begun)))
            other.execute("ROLLBACK")
        same = sum(image(client, ended(client, job)["id"]) == expected[n] for n, job in enumerate(sent))
    answered = refused.status_code == 503 and "Retry-After" in refused.headers
    return Promise(
        promise="while the database is locked jobs wait and resume afterwards",
        measured=f"answered {refused.status_code}, reads {read}, {same} of {len(sent)} pictures the same",
        held=answered and read == 200 and same == len(sent),
        limit="503 with Retry-After, reads succeed, all the same",
        details={"status": refused.status_code, "reads": read, "same": same},
    )


def torn_reads(reads: int) -> Promise:
    """Read a tile again and again while passes and stale attempts are written in another process."""
    tile, torn, older, newest, done = Tile(0, 0, 0, SIDE, SIDE), 0, 0, 0, 0
    with TemporaryDirectory() as folder:
        store = TileStore(Folder(Path(folder)))
        store.put_spec("job", b"{}")
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        writer = context.Process(target=_write, args=(folder, there), daemon=True)
        writer.start()
        stored = here.recv()
        while done < reads:
            if done % READS_OF_EACH == 0 and here.poll():
                stored = here.recv()
            pixels = store.get_tile("job", stored)
            torn += not bool((pixels == pixels[0, 0, 0]).all())
            older += int(pixels[0, 0, 0]) < newest
            newest = max(newest, int(pixels[0, 0, 0]))
            done += 1
        writer.kill()
        writer.join()
    return Promise(
        promise="no reader sees a torn tile, or an older pass after a newer one",
        measured=f"{reads} reads of {newest} passes of tile {tile.index}: {torn} torn, {older} older",
        held=torn == older == 0 and newest > 1,
        limit="0 torn, 0 older",
        details={"reads": reads, "passes": newest, "torn": torn, "older": older},
    )


def _write(folder: str, pipe: multiprocessing.connection.Connection) -> None:
    """Write one pass after another, and then what an attempt that was given up writes too late."""
    store, tile, number = TileStore(Folder(Path(folder))), Tile(0, 0, 0, SIDE, SIDE), 0
    while True:
        number += 1
        pass_ = Pass(index=number % 4, stride=1, first=0, last=1)
        fresh, stale = (np.full((SIDE, SIDE, 3), value, np.float32) for value in (number, -1))
        crc32 = store.put_tile("job", tile, pass_, 2 * number, fresh)
        pipe.send(StoredTile(tile, pass_, 2 * number, crc32))
        store.put_tile("job", tile, pass_, 2 * number - 1, stale)
