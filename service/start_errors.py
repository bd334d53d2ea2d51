"""Errors at the start of a service: no keys, a port in use, or too few open files allowed."""

from __future__ import annotations

from pathlib import Path

from service.errors import ServiceError


class NoKeysError(ServiceError):
    """A service without keys must not listen beyond this machine.

    Parameters
    ----------
    host : str
        The address to listen on.
    data : Path
        Its folder.
    """

    def __init__(self, host: str, data: Path) -> None:
        super().__init__(
            f"Anyone who reaches {host} could use this service, because it has no keys. Make one with "
            f"'penumbra keys add NAME --data {data}', or give --behind-proxy if a proxy authenticates users."
        )


class PortTakenError(ServiceError):
    """Another program listens at this address.

    Parameters
    ----------
    host, port : str, int
        The address to listen on.
    """

    def __init__(self, host: str, port: int) -> None:
        super().__init__(
            f"Another program uses port {port} of {host}. Stop it, or choose another with --port."
        )


class OpenFilesError(ServiceError):
    """The system lets the service open fewer files than its connections and workers need.

    Parameters
    ----------
    limit, needed : int
        Numbers of files that it may open, and that it needs.
    """

    def __init__(self, limit: int, needed: int) -> None:
        super().__init__(
            f"The service may open {limit} files and connections at once, and needs {needed}. Raise the hard "
            "limit ('ulimit -Hn', LimitNOFILE of systemd, --ulimit nofile of Docker), or lower "
            "max_connections or workers."
        )
