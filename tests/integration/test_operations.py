"""What the operator of a service asks, and what its documents say."""

from __future__ import annotations

from importlib.metadata import version

import httpx2
import jsonschema_rs

from tests.integration.support import scene


def test_a_running_service_says_that_it_is_well(client: httpx2.Client) -> None:
    assert [client.get(path).json() for path in ("/livez", "/readyz")] == [{"status": "ok"}] * 2


def test_a_service_says_which_one_it_is(client: httpx2.Client) -> None:
    expected = {"name": "penumbra", "version": version("penumbra-render"), "api": "v1"}
    assert client.get("/version").json() == expected


def test_the_schema_of_scenes_takes_scenes_and_nothing_else(client: httpx2.Client) -> None:
    schema = jsonschema_rs.validator_for(client.get("/v1/schemas/scene.json").json())
    assert schema.is_valid(scene())
    assert not schema.is_valid(scene() | {"shapes": [{"type": "cube"}]})
    assert not schema.is_valid(scene() | {"unknown": 1})
