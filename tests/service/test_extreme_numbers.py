"""Every number that can be set, at its ends: it is refused by its name, or a service works with it."""

import json
import math
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import httpx2
import pytest
import typer
from typer.main import get_command

from schemas.api.administration import PruneRequest
from schemas.api.jobs import JobRequest
from schemas.limits import Limits
from service.cli.commands import application
from service.cli.errors import CommandError
from service.cli.process import outcome
from service.cli.serve import read_settings
from service.client import Client
from service.server import RunningServer
from service.settings import Settings
from tests.service.in_process import in_process
from tests.service.sending import JSON, SMALL, bearer, problem_of
from tests.service.support import finish, scene, submit

TRIED = {
    "integer": [0, -1, 10**12, 10**300],
    "number": [0.0, -1.0, math.nan, math.inf, -math.inf, 1e12, 1e300],
}
LOWEST, LARGEST, HUGE = "lowest", "largest", "huge"
UNTRIED = {"workers": "a thousand processes", "limits": "a service with the least of each takes no scene"}
"""Values with which no service is started."""


def numbers(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The properties that are numbers, each with its type and its ends."""
    for name, found in schema["properties"].items():
        for form in (found, *found.get("anyOf", ())):
            if form.get("type") in TRIED:
                yield name, form


def values(form: dict[str, Any]) -> list[float]:
    return [*TRIED[form["type"]], *(form[end] for end in ("minimum", "maximum") if end in form)]


def variable(name: str) -> str:
    return f"PENUMBRA_{name.upper()}"


SETTINGS = dict(numbers(Settings.model_json_schema()))
LIMITS = {f"limits__{field.name}": {"type": "integer", "minimum": 1} for field in fields(Limits)}


@pytest.mark.parametrize("name", [*SETTINGS, *LIMITS])
def test_setting_states_its_ends_or_is_refused_by_name(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    form = (SETTINGS | LIMITS)[name]
    for value in values(form):
        monkeypatch.setenv(variable(name), str(value))
        try:
            read_settings({})
            said = ""
        except CommandError as error:
            said = str(error)
        is_within = form["minimum"] <= value <= form.get("maximum", math.inf)
        is_refused = name.rpartition("__")[2] in said.lower() and "must be" in said
        assert is_refused is not is_within, (value, said)
    if name in SETTINGS:
        assert "maximum" in form


def of_all(end: str) -> dict[str, float]:
    """The same end of all settings, as far as they have it."""
    found = {}
    for name, form in SETTINGS.items():
        value = {LOWEST: form["minimum"], LARGEST: form["maximum"], HUGE: TRIED[form["type"]][-2]}[end]
        if form["minimum"] <= value <= form["maximum"] and name not in UNTRIED:
            found[name] = value
    return found


@pytest.mark.slow
@pytest.mark.parametrize("end", [LOWEST, LARGEST, HUGE])
def test_service_works_at_the_ends_of_its_settings(tmp_path: Path, end: str) -> None:
    chosen = of_all(end)
    limits = Limits(**{field.name: 10**300 for field in fields(Limits)}) if end == HUGE else Limits()
    settings = Settings(**chosen | {"data": tmp_path, "workers": 1, "limits": limits, "log_level": "error"})
    with in_process(settings) as local, local.client() as client:
        job = client.post("/v1/jobs", json=SMALL, headers={"Prefer": "wait=30"})
        assert job.status_code == 202, job.text
        state = client.get(job.json()["links"]["tiles"], params={"wait": 30}).json()["state"]
        # Where pictures are kept for a second, or none are, it may have expired meanwhile.
        assert state in ({"succeeded", "expired"} if end == LOWEST else {"succeeded"})
        listed = client.get("/v1/jobs").json()["jobs"]
        assert [one["damage"] for one in listed] == [None]
        assert client.post("/v1/prune", json={}).status_code == 200


@pytest.mark.slow
def test_limit_of_one_is_named_by_what_it_refuses(tmp_path: Path) -> None:
    settings = Settings(
        data=tmp_path, workers=1, log_level="error", limits=Limits(max_shapes=1, max_pixels=1)
    )
    with in_process(settings) as local, local.client() as client:
        assert "PENUMBRA_LIMITS__MAX_" in client.post("/v1/jobs", json=SMALL).text


def options() -> Iterator[tuple[str, str, Any, dict[str, Any]]]:
    """The numeric options of all commands: words, option, command, and its type with its ends."""
    found: list[tuple[str, Any]] = [("", get_command(application()))]
    while found:
        words, command = found.pop()
        found += [(f"{words} {name}", one) for name, one in getattr(command, "commands", {}).items()]
        for option in command.params:
            described = getattr(option, "type_descriptor", None)
            kind = {int: "integer", float: "number"}.get(described and described.annotation)
            if kind and option.opts[0].startswith("-"):
                ends = {"minimum": option.min, "maximum": option.max}
                form = {name: end for name, end in ends.items() if end is not None}
                yield words.strip(), option.opts[0], command, {"type": kind} | form


OPTIONS = [pytest.param(*found, id=" ".join(found[:2])) for found in options()]


@pytest.mark.parametrize(("words", "option", "command", "form"), OPTIONS)
def test_option_beyond_its_ends_is_refused_by_name(
    words: str, option: str, command: Any, form: dict[str, Any]
) -> None:
    lowest, largest = form.get("minimum", -math.inf), form.get("maximum", math.inf)
    for value in values(form):
        try:
            command.make_context(words, [f"{option}={value}"])
            said = ""
        except typer.BadParameter as error:
            said = error.format_message()
        is_within = lowest <= value <= largest or "minimum" not in form
        assert (f"'{option}'" in said) is not is_within, (value, said)


@pytest.mark.slow
def test_key_at_the_ends_of_its_limits_submits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = []
    for words, option, _, form in options():
        for value in values(form) if words == "keys add" else ():
            code = outcome(["keys", "add", "ann", f"{option}={value}", "--data", str(tmp_path)])
            said = capsys.readouterr()
            made += [(option, value, said.out.strip())] if not code else []
            assert not code or (code == 2 and option in said.err)
    assert {option for option, _, _ in made} == {"--max-jobs", "--max-cpu-seconds"}
    with in_process(Settings(data=tmp_path, workers=1, log_level="error")) as local:
        for option, value, key in made:
            with local.client(headers=bearer(key)) as client:
                sent = client.post("/v1/jobs", json=SMALL, headers={"Cache-Control": "no-cache"})
            # Too dear, or one too many, for the lowest limits.
            assert sent.status_code in ({202, 422, 429} if value <= 1 else {202}), (option, value, sent.text)


def test_number_in_a_request_is_pointed_at(api: httpx2.Client) -> None:
    for model, path in ((JobRequest, "/v1/jobs"), (PruneRequest, "/v1/prune")):
        for name, form in numbers(model.model_json_schema()):
            for value in values(form):
                body = (SMALL if model is JobRequest else {"dry_run": True}) | {name: value}
                answer = api.post(path, content=json.dumps(body), headers=JSON)
                if not answer.is_success:
                    assert problem_of(answer, 422)["errors"][0]["pointer"] in {f"/{name}", ""}, value


def test_timeout_of_any_length_is_waited_for(server: RunningServer) -> None:
    with httpx2.Client(base_url=server.url) as client:
        job = finish(client, submit(client, scene(8, 8, samples=1)))["id"]
    for seconds in (None, 0.5, 1e12, 1e300, math.inf):
        with Client(server.url, timeout=seconds, retry_seconds=seconds) as client:
            assert client.wait(job, timeout=seconds).state == "succeeded"
