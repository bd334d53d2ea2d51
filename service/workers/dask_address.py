"""Which Dask schedulers are used, and how: what travels to them and back is code as well as data."""

from __future__ import annotations

from urllib.parse import urlsplit

from service.access.addresses import is_loopback
from service.errors import UnsafeClusterError
from service.settings import Settings


def check_address(settings: Settings) -> None:
    """Refuse a cluster that strangers on the network could give orders to.

    Raises
    ------
    UnsafeClusterError
        If the address is not one of a scheduler, or is another machine's and connections to it would not be
        encrypted; the message says what to do.
    """
    if settings.dask is None:
        return
    parts = urlsplit(settings.dask)
    if parts.scheme not in ("tcp", "tls") or not parts.hostname:
        raise UnsafeClusterError(
            f"{settings.dask} is not the address of a Dask scheduler. Write it like tls://host:8786."
        )
    if parts.scheme == "tls":
        _check_certificates(settings)
    elif not is_loopback(parts.hostname) and not settings.dask_trusted_network:
        raise UnsafeClusterError(
            f"{settings.dask} is on another machine, and tcp:// is not encrypted: whoever reaches that port "
            "runs code on every worker. Start the cluster with certificates and write "
            f"tls://{parts.netloc}, with the settings dask_tls_ca, dask_tls_cert and dask_tls_key. "
            "Where the network itself encrypts and keeps strangers out, set dask_trusted_network."
        )


def _check_certificates(settings: Settings) -> None:
    files = {name: getattr(settings, name) for name in ("dask_tls_ca", "dask_tls_cert", "dask_tls_key")}
    missing = [name for name, path in files.items() if path is None]
    if missing:
        raise UnsafeClusterError(f"A tls:// address needs certificates. Set {', '.join(missing)} as well.")
    unreadable = [str(path) for path in files.values() if not path.is_file()]
    if unreadable:
        raise UnsafeClusterError(f"There is no file {', '.join(unreadable)}, which the settings name.")
