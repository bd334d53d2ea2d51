"""Results as JSON files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def encoded(document: Mapping[str, Any]) -> bytes:
    """Encode a JSON file as UTF-8 with a final newline; NaN and infinity raise ValueError."""
    return (json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
