"""What the page about operations says is so."""

from __future__ import annotations

import re
import tomllib

from service.settings import Settings
from service.telemetry.metrics import Metrics
from service.workers.tasks import Cause
from tests.pages import blocks, page

PAGE = page("how-to/operations.md")


def test_the_page_lists_every_counter() -> None:
    ours = [family for family in Metrics().registry.collect() if family.name.startswith("penumbra_")]
    counted = {f"{family.name}_total" for family in ours if family.type == "counter"}
    found = set(re.findall(r"`(penumbra_\w+_total)(?:\{\w+\})?` \| counter", PAGE))
    assert found == counted
    shown = set(re.findall(r"`(penumbra_\w+)(?:\{\w+\})?` \| gauge", PAGE))
    assert shown >= {family.name for family in ours if family.type == "gauge"}


def test_the_page_lists_every_cause_of_a_retry() -> None:
    (sentence,) = re.findall(r"^Causes of .*?\n\n", PAGE, re.MULTILINE | re.DOTALL)
    assert set(re.findall(r"`([a-z_]+)`", sentence)) - {"penumbra_retries_total"} == set(Cause)


def test_the_file_that_the_page_shows_is_taken() -> None:
    (example,) = blocks(PAGE, "toml")
    settings = Settings(**tomllib.loads(example))
    assert (settings.max_user_jobs, settings.limits.max_samples) == (300, 1024)
