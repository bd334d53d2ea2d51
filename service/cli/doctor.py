"""``penumbra doctor``: what is installed, found and configured, and from where."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli import output
from service.cli.errors import CommandError, ExitCode
from service.cli.extras import has_server, installation, missing, packages_of_extras
from service.cli.options import ConfigOption, DatabaseOption, JsonOption
from service.cli.serve import read_settings

if TYPE_CHECKING:
    from service.settings import Settings

Level = Literal["ok", "warn", "fail"]
COLORS: dict[Level, str] = {"ok": "green", "warn": "yellow", "fail": "red"}
LIBRARIES = ("numpy", "pillow", "pydantic", "httpx2")
SERVER_LIBRARIES = ("fastapi", "uvicorn", "sqlalchemy", "alembic")
TRACES = ("opentelemetry-sdk", "opentelemetry-exporter-otlp-proto-http")
PREFIX = "PENUMBRA_"
CLIENT = ("SERVER", "KEY", "CONFIG")
"""Variables that are not settings of a service."""

LITTLE_MEMORY = 1 << 30
GIB = 1 << 30


@dataclass(frozen=True, slots=True)
class Check:
    """One check: what was found, whether that is good, and advice if it is not."""

    name: str
    level: Level
    found: str
    advice: str = ""


def doctor(
    numerics: Annotated[
        bool,
        typer.Option(
            "--numerics",
            help="Run a self-test instead: what arithmetic must do on this machine, and exact answers of the "
            "renderer. Exit with 1 if an answer is wrong.",
        ),
    ] = False,
    data: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="Verify instead every file that a service has stored in its data folder, or in its bucket "
            "s3://NAME/PREFIX, and name the damaged ones. Exit with 1 if there is one.",
        ),
    ] = None,
    server: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Show instead what the workers of a running service are at, and what each of its users "
            "uses. For admins.",
        ),
    ] = None,
    database: DatabaseOption = None,
    config: ConfigOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show what is installed, found and configured, and from where."""
    if server is not None:
        from service.cli.activity import show_activity

        show_activity(server, as_json=as_json)
        return
    if data is not None:
        from service.cli.stored_files import check_stored

        check_stored(data, database, config, as_json=as_json)
        return
    if numerics:
        from service.cli.numerics import check_numerics

        check_numerics(as_json=as_json)
        return
    checks = list(_all_checks(config))
    settings = list(_settings(config)) if has_server() else []
    lines = [
        *(line for check in checks for line in _lines(check)),
        *(f"      {each['name']:<24} {each['value']:<24} {each['source']}" for each in settings),
    ]
    document = {"checks": [asdict(check) for check in checks], "settings": settings}
    output.report(document, lines, as_json=as_json)
    if any(check.level == "fail" for check in checks):
        raise typer.Exit(ExitCode.SERVER)


def _all_checks(config: Path | None) -> Iterator[Check]:
    yield from _software()
    yield _simd()
    yield _processors()
    yield _memory()
    if has_server():
        yield from _variables()
        yield from _service(config)
    yield from _extras()


def _lines(check: Check) -> Iterator[str]:
    mark = output.emphasis(f"{check.level:<5}", COLORS[check.level])
    yield f"{mark} {check.name:<12} {check.found}"
    if check.advice:
        yield f"{'':<18} {check.advice}"


def _software() -> Iterator[Check]:
    import platform
    from importlib.metadata import version

    yield Check("penumbra", "ok", f"{version('penumbra-render')} in {Path(__file__).parents[2]}")
    yield Check("python", "ok", f"{platform.python_version()} on {platform.platform()}")
    names = LIBRARIES + (SERVER_LIBRARIES if has_server() else ())
    yield Check("libraries", "ok", ", ".join(f"{name} {version(name)}" for name in names))


def _simd() -> Check:
    import numpy as np

    extensions = np.show_config(mode="dicts")["SIMD Extensions"]
    found = extensions.get("found", [])
    shown = ", ".join([*extensions.get("baseline", []), *found])
    advice = "" if found else "NumPy uses no more than its baseline; rendering may be slow."
    return Check("numpy simd", "warn" if advice else "ok", shown, advice)


def _processors() -> Check:
    from renderer.processors import usable_processors

    usable = usable_processors()
    there = os.cpu_count() or usable
    return Check("processors", "ok", f"{usable} usable of {there}")


def _memory() -> Check:
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return Check("memory", "warn", "not known", "This system does not report how much memory is free.")
    reported = dict(line.split(":", 1) for line in lines)
    available = int(reported["MemAvailable"].split()[0]) * 1024
    advice = "A large picture needs more; close other programs." if available < LITTLE_MEMORY else ""
    return Check("memory", "warn" if advice else "ok", f"{available / GIB:.1f} GiB free", advice)


def _variables() -> Iterator[Check]:
    """Variables that look like settings but are not: they would be ignored silently."""
    from schemas.reading.translation import nearest

    known = [*_names_of_settings(), *CLIENT]
    for variable in sorted(os.environ):
        name = variable.upper().removeprefix(PREFIX)
        if variable.upper().startswith(PREFIX) and name not in known:
            meant = nearest(name, known)
            advice = f"Did you mean {PREFIX}{meant}?" if meant else "It is unknown, and has no effect."
            yield Check("variable", "warn", output.harmless(variable), advice)


def _names_of_settings() -> Iterator[str]:
    """Names of settings in variables, those in groups included."""
    from service.settings import Settings

    for name, field in Settings.model_fields.items():
        yield name.upper()
        kind = field.annotation
        if is_dataclass(kind):
            yield from (f"{name}__{inner.name}".upper() for inner in fields(kind))


def _service(config: Path | None = None) -> Iterator[Check]:
    try:
        settings = read_settings({}, config=config)
    except CommandError as error:
        yield Check("settings", "fail", str(error), "Correct the variables PENUMBRA_..., or the file.")
        return
    yield _data_folder(settings)
    if settings.store:
        yield _store(settings)
    yield _database(settings)
    yield _traces()


def _data_folder(settings: Settings) -> Check:
    import shutil

    folder = settings.data.absolute()
    shown = f"{folder} (from {_source('data')})"
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        advice = f"{existing} is not writable; set PENUMBRA_DATA to another folder."
        return Check("data folder", "fail", shown, advice)
    free = shutil.disk_usage(existing).free
    state = f"{free / GIB:.1f} GiB free" + ("" if folder.exists() else ", created when the service starts")
    if free < settings.min_free_bytes:
        return Check("data folder", "fail", f"{shown}, {state}", "The disk is too full for the service.")
    return Check("data folder", "ok", f"{shown}, {state}")


def _store(settings: Settings) -> Check:
    from service.errors import StoreError
    from service.storage.folder import place_of

    shown = f"{settings.store} (from {_source('store')})"
    try:
        place_of(settings.place).check()
    except StoreError as error:
        return Check("store", "fail", shown, str(error))
    return Check("store", "ok", f"{shown}, reachable")


def _database(settings: Settings) -> Check:
    from sqlalchemy.exc import SQLAlchemyError

    from service.errors import DatabaseUrlError, DatabaseVersionError
    from service.storage.database.migrations import SCRIPTS
    from service.storage.database.migrations.running import check_version
    from service.storage.database.urls import engine_of, parse

    try:
        url = parse(settings.database_url)
        engine = engine_of(settings.database_url)
    except DatabaseUrlError as error:
        return Check("database", "fail", f"PENUMBRA_DATABASE cannot be used. {error}")
    shown = f"{url.set(query={}).render_as_string(hide_password=True)} (from {_source('database')})"
    if url.get_backend_name() == "sqlite" and url.database and not Path(url.database).exists():
        return Check("database", "ok", f"{shown}, created when the service starts")
    try:
        with engine.connect() as connection:
            check_version(connection, SCRIPTS)
    except DatabaseVersionError as error:
        return Check("database", "fail", shown, str(error))
    except SQLAlchemyError as error:
        return Check("database", "fail", shown, f"It cannot be reached: {str(error).splitlines()[0]}")
    finally:
        engine.dispose()
    return Check("database", "ok", f"{shown}, reachable")


def _traces() -> Check:
    """Destination of spans. Only the host is shown, as other parts of the address may be secret."""
    from urllib.parse import urlsplit

    from service.telemetry.spans import ENDPOINTS, MISSING, wanted_by

    variable = wanted_by()
    if variable is None:
        return Check("traces", "ok", f"not sent: {ENDPOINTS[-1]} does not say where to")
    address = urlsplit(os.environ[variable])
    host = address.netloc.rpartition("@")[2]
    shown = f"{address.scheme}://{host} (from {variable})"
    if any(missing(TRACES)):
        return Check("traces", "warn", f"not sent to {shown}", MISSING)
    return Check("traces", "ok", f"sent to {shown}")


def _settings(config: Path | None) -> Iterator[dict[str, str]]:
    """Every setting with its value and origin; none if they are invalid."""
    from service.settings import UNLIMITED, WITHOUT_LIMIT, source_of

    try:
        settings = read_settings({}, config=config)
    except CommandError:
        return
    for name in type(settings).model_fields:
        value = getattr(settings, name)
        if is_dataclass(value) and not isinstance(value, type):
            for inner, number in asdict(value).items():
                yield {"name": f"{name}.{inner}", "value": str(number), "source": source_of((name, inner))}
        else:
            shown = _without_password(value) if name == "database" else value
            is_unlimited = value is None and name in WITHOUT_LIMIT
            yield {
                "name": name,
                "value": UNLIMITED if is_unlimited else str(shown),
                "source": source_of((name,)),
            }


def _without_password(url: str | None) -> str | None:
    from sqlalchemy.engine import make_url
    from sqlalchemy.exc import ArgumentError

    if url is None:
        return None
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError):
        return "no database URL"
    # PostgreSQL also accepts passwords as options.
    query = {name: "***" if "pass" in name else value for name, value in parsed.query.items()}
    return parsed.set(query=query).render_as_string(hide_password=True)


def _source(setting: str) -> str:
    from service.settings import DEFAULT, source_of

    source = source_of((setting,))
    return "the default" if source == DEFAULT else source


def _extras() -> Iterator[Check]:
    for extra, packages in packages_of_extras().items():
        absent = ", ".join(missing(packages))
        cure = f"If you need it: {installation(extra)}" if absent else ""
        found = f"missing: {absent}" if absent else ", ".join(packages)
        yield Check(f"[{extra}]", "warn" if absent else "ok", found, cure)
