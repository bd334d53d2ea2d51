"""Results as JSON files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def encoded(document: Mapping[str, Any]) -> bytes:
    """A JSON file in UTF-8, with a line end at its end; NaN and infinity are refused."""
    return (json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
