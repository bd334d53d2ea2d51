"""``python -m service``: the service alone, set up by the environment."""

from __future__ import annotations

from service.server import run
from service.settings import Settings

if __name__ == "__main__":
    run(Settings())
