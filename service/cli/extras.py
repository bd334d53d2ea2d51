"""Optional packages of this installation, by the extra that brings them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

PROJECT = "penumbra-render"
SERVER = "server"


def packages_of_extras() -> dict[str, list[str]]:
    """The packages of each extra, as the project's own metadata lists them.

    Other extras of a service include `server`, and are shown without its packages.
    """
    import re
    from importlib.metadata import requires

    extras: dict[str, list[str]] = {}
    for requirement in requires(PROJECT) or ():
        match = re.match(r"([\w.-]+).*\bextra == ['\"]([\w-]+)['\"]", requirement)
        if match:
            extras.setdefault(match[2], []).append(match[1])
    server = extras.get(SERVER, [])
    return {
        extra: [name for name in packages if extra == SERVER or name not in server]
        for extra, packages in extras.items()
    }


def missing(packages: Iterable[str]) -> Iterator[str]:
    """Yield the packages that are not installed."""
    from importlib.metadata import PackageNotFoundError, version

    for name in packages:
        try:
            version(name)
        except PackageNotFoundError:
            yield name


def installation(extra: str) -> str:
    """The command that installs an extra."""
    return f"pip install '{PROJECT}[{extra}]'"


def has_server() -> bool:
    """Whether the packages of a service are installed."""
    return not any(missing(packages_of_extras().get(SERVER, ())))
