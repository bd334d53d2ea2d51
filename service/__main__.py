"""``python -m service``: the service without the command line, configured by the environment."""

from __future__ import annotations

from service.settings import Settings
from service.workers.fork_server import fork_server

if __name__ == "__main__":
    try:
        settings = Settings()
    except Exception:
        # Settings that cannot be used are reported as everything else is.
        from service import logs

        logs.configure("info")
        raise
    if settings.engine == "slots":
        fork_server.start()
    from service.server import inherited_listener, run

    run(settings, inherited_listener())
