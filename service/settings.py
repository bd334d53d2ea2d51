"""Settings of a service: from arguments, the environment, or a file."""

from __future__ import annotations

import os
import re
import tomllib
from dataclasses import replace
from ipaddress import ip_network
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict

from renderer.processors import usable_processors
from schemas.api.administration import Role
from schemas.limits import Limits

CONFIG = "PENUMBRA_CONFIG"
"""The variable that names a file of settings."""

DEFAULT = "default"
MIB = 1024 * 1024
RAY_BYTES = 192
"""JSON of a ray: six doubles of up to 24 characters, with brackets, commas and blanks."""

_SERVICE_LINK = (
    "Kubernetes sets this for a Service named penumbra; it is no port. Set enableServiceLinks: false in the "
    "pod's spec, or give the Service another name"
)
_NO_ADDRESS = "write addresses such as 10.0.0.5 and networks such as 10.1.0.0/16: {error}"
_NO_PROXY = "proxy_user_header and proxy_role say whom a proxy lets in: set behind_proxy too"
_NO_HOSTS = (
    "behind_proxy needs hosts, the names under which users reach the service: a page of another site could "
    "otherwise send requests to it under a name of its own. Set hosts (PENUMBRA_HOSTS)"
)
_NO_USERS = (
    "behind_proxy does not say what users may do. Name the header in which the proxy sends the user, "
    "proxy_user_header (PENUMBRA_PROXY_USER_HEADER), or give all users one role, proxy_role "
    "(PENUMBRA_PROXY_ROLE): submit, staff or admin"
)

# Bounds within which a service works: beyond them the arithmetic of times, the database, or the system would
# fail in the middle of a job.
Count = Annotated[int, Field(ge=1, le=2**31 - 1)]
"""An integer of the database."""
MOST_BYTES = 2**50
"""More than a disk has; a limit on memory must be one that the kernel takes."""
Bytes = Annotated[int, Field(ge=0, le=MOST_BYTES)]
CpuSeconds = Annotated[float, Field(ge=1, le=1e12)]
"""Fewer than one admits no job; headers write the number out."""
LONGEST_SILENCE = 20
"""Clients give up an answer after 30 seconds of silence; a cancelled job has 5 seconds beyond its grace."""
Pause = Annotated[float, Field(ge=1, le=3600)]
"""Seconds that a request waits: at 0 clients would poll without a pause."""
Age = Annotated[float, Field(ge=1, le=1e10)]
"""Three centuries at most: dates have four digits, and a job is kept twice as long as its picture."""
UNLIMITED, WITHOUT_LIMIT = "none", ("keep_seconds", "max_stored_bytes", "keep_asset_seconds")
"""The word for no limit, and the settings that accept it."""

_BUCKET = re.compile(r"s3://[a-z0-9][a-z0-9.-]{1,61}[a-z0-9](/[A-Za-z0-9._/-]*)?")


class SettingsFileError(Exception):
    """The settings file cannot be used.

    No ValueError: pydantic would make it an error of some field.
    """


class FileSource(PydanticBaseSettingsSource):
    """Settings of the file, if one is named.

    Raises
    ------
    SettingsFileError
        It is missing, or is not TOML.
    """

    def __init__(self, settings_cls: type[BaseSettings]) -> None:
        super().__init__(settings_cls)
        self.content = _content()

    def get_field_value(self, field: FieldInfo, field_name: str) -> tuple[Any, str, bool]:  # noqa: ARG002  (an interface)
        """Value of one setting; None if the file does not have it."""
        return self.content.get(field_name), field_name, False

    def __call__(self) -> dict[str, Any]:
        """The whole content, so that unknown names are refused, too."""
        return self.content


class Settings(BaseSettings):
    """Settings of one service, from arguments, ``PENUMBRA_<NAME>``, or a file, in this order.

    Nested names take two underscores: ``PENUMBRA_LIMITS__MAX_PIXELS=1000000``. The file is TOML, and
    ``PENUMBRA_CONFIG`` names it.
    """

    model_config = SettingsConfigDict(
        env_prefix="PENUMBRA_", env_nested_delimiter="__", frozen=True, allow_inf_nan=False
    )

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003  (an interface)
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003  (an interface)
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Arguments before variables, variables before the file."""
        return init_settings, env_settings, FileSource(settings_cls)

    data: Path = Field(
        default=Path("penumbra-data"), description="Folder for the database, pictures and textures."
    )
    store: str | None = Field(
        default=None,
        description="Bucket for pictures and textures, s3://bucket/prefix; by default they are in the data "
        "folder. Where it is and who may use it is in AWS_ENDPOINT_URL, AWS_ACCESS_KEY_ID and so on.",
    )
    host: str = Field(default="127.0.0.1", description="Address to listen on.")
    behind_proxy: bool = Field(
        default=False,
        description="Require no keys: a proxy in front of the service authenticates its users. Needs "
        "`hosts`, and `proxy_user_header` or `proxy_role`.",
    )
    proxy_user_header: str | None = Field(
        default=None,
        pattern=r"^[A-Za-z0-9-]{1,64}$",
        description="Header in which the proxy names the user, such as X-Forwarded-User. The proxy must "
        "remove what clients send under this name.",
    )
    proxy_role: Role | None = Field(
        default=None,
        description="Role of all users that the proxy admits: submit, staff or admin. With "
        "`proxy_user_header` submit by default; without it all requests belong to one user.",
    )
    trusted_proxies: str | None = Field(
        default=None,
        description="Addresses and networks, separated by spaces, of proxies that are trusted about users "
        "(`proxy_user_header`), TLS and client addresses; by default 127.0.0.1 and ::1.",
    )
    hosts: str = Field(
        default="",
        description="Names under which the service answers, separated by spaces. By default any name, and "
        "only loopback names if no keys are required.",
    )
    max_connections: Count = Field(
        default=800, description="Concurrent connections; more are answered 503. An event stream takes one."
    )
    max_address_connections: Count = Field(
        default=400,
        description="Concurrent connections of one address, unless `behind_proxy`; more are answered 429.",
    )
    max_user_streams: Count = Field(
        default=200,
        description="Concurrent event streams of one user, and requests that wait for events, where keys "
        "distinguish users.",
    )
    client_timeout_seconds: float = Field(
        default=20.0,
        ge=0.1,
        le=3600,
        description="Maximum seconds for the head of a request, the beginning of its body, and each pause; "
        "the rest must arrive, and responses be read, at 16 KiB a second.",
    )
    port: int = Field(default=8000, ge=0, le=65535, description="Port to listen on; 0 picks a free one.")
    workers: int = Field(
        default_factory=usable_processors, ge=1, le=1024, description="Processes that render."
    )
    database: str | None = Field(
        default=None,
        description="Database, postgresql://user@host/name; by default an SQLite file in the data folder.",
    )
    engine: Literal["slots", "dask"] = Field(
        default="slots",
        description="Where tiles are rendered: in processes of this machine, or on a Dask cluster.",
    )
    dask: str | None = Field(
        default=None,
        description="Address of the cluster's scheduler, tls://host:8786; by default a small cluster of "
        "this machine alone, for development.",
    )
    dask_tls_ca: Path | None = Field(
        default=None, description="PEM file of the certificate authority of the cluster."
    )
    dask_tls_cert: Path | None = Field(default=None, description="PEM file of this service's certificate.")
    dask_tls_key: Path | None = Field(default=None, description="PEM file of its key.")
    dask_trusted_network: bool = Field(
        default=False,
        description="Allow a scheduler without TLS on another machine, or although keys are required, "
        "because the network itself is encrypted and private.",
    )
    tile_size: int | None = Field(
        default=None,
        ge=8,
        le=4096,
        description="Pixels along a tile's side; by default the renderer's choice.",
    )

    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="Lowest level that is logged."
    )

    limits: Limits = Field(default_factory=Limits, description="Limits of a scene and of its files.")
    max_cpu_seconds: CpuSeconds = Field(default=3600.0, description="Largest predicted cost of a job.")
    max_queued_jobs: Count = Field(default=10_000, description="Queued and running jobs of all users.")
    max_queued_cpu_seconds: CpuSeconds = Field(
        default=1_000_000.0, description="Predicted cost of all queued and running jobs."
    )
    max_user_jobs: Count = Field(
        default=2_000, description="Queued and running jobs of one user, unless the key has its own quota."
    )
    max_user_cpu_seconds: CpuSeconds = Field(
        default=100_000.0,
        description="Predicted cost of one user's queued and running jobs, unless the key has its own quota.",
    )
    max_asset_bytes: Bytes = Field(default=64 * MIB, description="Largest texture or mesh file.")
    max_user_asset_bytes: Bytes = Field(
        default=4096 * MIB,
        description="Total bytes of one user's textures and meshes, where keys distinguish users.",
    )
    max_trace_rays: Count = Field(default=100_000, description="Most rays in one trace request.")
    max_user_calls: Count = Field(
        default=16,
        description="Concurrent calls of one user, waiting ones included: plans, quotes, previews, traces, "
        "comparisons and inspections.",
    )
    max_wait_seconds: Pause = Field(
        default=60.0, description="Maximum seconds that a request waits for events."
    )
    max_events: Count = Field(default=1000, description="Most tile events in one response.")
    heartbeat_seconds: float = Field(
        default=10.0, ge=0.01, le=LONGEST_SILENCE, description="Idle seconds before a keep-alive comment."
    )

    keep_seconds: Age | None = Field(
        default=30 * 86400.0,
        description="Seconds that a picture is kept after its job has succeeded, 30 days by default, `none` "
        "for ever; the job is deleted after as long again.",
    )
    max_stored_bytes: Bytes | None = Field(
        default=None,
        description="Bytes of all finished pictures; beyond them the oldest unpinned ones of the user with "
        "the most bytes are deleted. Unlimited by default (`none`).",
    )
    keep_asset_seconds: Age | None = Field(
        default=86400.0,
        description="Seconds that a texture or mesh that no picture needs is kept after it was last sent or "
        "requested, a day by default, or `none` for ever.",
    )
    max_user_pins: int = Field(
        default=100, ge=0, le=2**31 - 1, description="Jobs that a user may keep pinned; staff may pin more."
    )

    worker_memory_bytes: int = Field(
        default=4096 * MIB, ge=256 * MIB, le=MOST_BYTES, description="Address space of one worker."
    )
    max_attempts: Count = Field(default=3, description="Worker crashes per tile before the job fails.")
    worker_silence_seconds: float = Field(
        default=30.0,
        ge=5,
        le=86400,
        description="Seconds without a heartbeat after which a worker is replaced; it sends one each second.",
    )
    max_task_seconds: float = Field(
        default=3600.0,
        ge=1,
        le=86400 * 365,
        description="Maximum seconds for one task; then the worker is killed and the task fails.",
    )
    cancel_grace_seconds: float = Field(
        default=0.2,
        ge=0,
        le=LONGEST_SILENCE,
        description="Seconds that the running tile of a cancelled job has to finish.",
    )
    min_free_bytes: Bytes = Field(
        default=64 * MIB, description="Free disk below which the service is not ready."
    )

    @property
    def database_url(self) -> str:
        """URL of the database in use."""
        return self.database or f"sqlite:///{self.sqlite_file}"

    @property
    def sqlite_file(self) -> Path:
        """The default database."""
        return self.data.absolute() / "penumbra.sqlite"

    @field_validator(*WITHOUT_LIMIT, mode="before")
    @classmethod
    def _may_be_unlimited(cls, kept: object) -> object:
        return None if isinstance(kept, str) and kept.strip().lower() == UNLIMITED else kept

    @field_validator("store")
    @classmethod
    def _is_a_bucket(cls, store: str | None) -> str | None:
        if store is None or _BUCKET.fullmatch(store):
            return store
        names = "a bucket has 3 to 63 small letters, digits, dots and hyphens"
        raise PydanticCustomError("store", f"write s3://BUCKET or s3://BUCKET/PREFIX; {names}")

    @field_validator("trusted_proxies")
    @classmethod
    def _are_addresses(cls, proxies: str | None) -> str | None:
        for proxy in (proxies or "").split():
            try:
                ip_network(proxy)
            except ValueError as error:
                raise PydanticCustomError("trusted_proxies", _NO_ADDRESS, {"error": str(error)}) from None
        return proxies

    @field_validator("port", mode="before")
    @classmethod
    def _is_no_link(cls, port: object) -> object:
        if isinstance(port, str) and "://" in port:
            raise PydanticCustomError("service_link", _SERVICE_LINK)
        return port

    @model_validator(mode="after")
    def _names_who_comes_by_the_proxy(self) -> Self:
        if not self.behind_proxy:
            if self.proxy_user_header or self.proxy_role:
                raise PydanticCustomError("proxy", _NO_PROXY)
        elif not self.hosts.split():
            raise PydanticCustomError("proxy", _NO_HOSTS)
        elif not (self.proxy_user_header or self.proxy_role):
            raise PydanticCustomError("proxy", _NO_USERS)
        return self

    @property
    def trace_limits(self) -> Limits:
        """Size limit of a trace request: a scene, and as many rays as `max_trace_rays` allows."""
        return replace(
            self.limits,
            max_body_bytes=self.limits.max_body_bytes + RAY_BYTES * self.max_trace_rays,
            # Six numbers each, and room for as many rays too many, so that they are counted as rays.
            max_values=self.limits.max_values + 12 * self.max_trace_rays,
        )

    @property
    def place(self) -> str:
        """Address of pictures and textures, for `service.storage.folder.place_of`."""
        return self.store or str(self.data)


def _content() -> dict[str, Any]:
    """Content of the settings file; empty if none is named.

    Raises
    ------
    SettingsFileError
        It is missing, or is not TOML.
    """
    name = os.environ.get(CONFIG)
    if not name:
        return {}
    try:
        return tomllib.loads(Path(name).read_text(encoding="utf-8"))
    except OSError as error:
        raise SettingsFileError(f"The settings file {name} cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsFileError(f"The settings file {name} is not TOML: {error}") from error


def source_of(path: tuple[str, ...]) -> str:
    """Origin of a setting's value: a variable, the file, or the default.

    Parameters
    ----------
    path
        Its name, or the name of its group and its own.
    """
    variable = "PENUMBRA_" + "__".join(path).upper()
    if variable in {name.upper() for name in os.environ}:
        return variable
    content: Any = _content()
    for name in path:
        if not isinstance(content, dict) or name not in content:
            return DEFAULT
        content = content[name]
    return str(Path(os.environ[CONFIG]))
