"""The references of the command line and of HTTP leave nothing out."""

import re
from typing import Any

import pytest

from service.api import problems
from service.api.reference import calls_of, objects_of, shared_replies
from service.app import create_app
from service.settings import Settings
from tools.docs import generate_command_line_reference as command_line
from tools.docs import generate_http_reference as http
from tools.docs import http_examples
from tools.docs.templates import PLACE

WHOLE_SERVICE = {"internal", "job_damaged", "database", "store_away", "store_read_only", "store_full"}
"""Codes of faults that any call may meet."""
OF_HTTP_ITSELF = {"bad_request", "body_incomplete", "not_usable"}
"""Codes of requests that are broken before a call looks at them."""
CAUGHT = {"asset_not_usable", "nothing_to_fit", "upload"}
"""Codes of errors that calls catch, and report in other forms."""


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return create_app(Settings()).openapi()


def test_the_page_of_the_command_line_has_every_command_once() -> None:
    places = re.findall(PLACE, command_line.TEMPLATE.read_text(encoding="utf-8"))
    assert sorted(places) == sorted(command_line.parts())


def test_every_call_has_one_example_and_a_recorded_response(document: dict[str, Any]) -> None:
    calls = sorted(call.title for call in calls_of(document))
    assert sorted(example["call"] for example in http_examples.EXAMPLES["example"]) == calls
    assert sorted(http_examples.kept()) == calls


def test_an_example_is_answered_with_a_status_that_its_call_documents(document: dict[str, Any]) -> None:
    statuses = {call.title: {reply.status for reply in call.replies} for call in calls_of(document)}
    answered = {title: int(answer["status"].split()[1]) for title, answer in http_examples.kept().items()}
    assert {title: status for title, status in answered.items() if status not in statuses[title]} == {}


def test_every_call_has_a_purpose_and_says_what_comes_back(document: dict[str, Any]) -> None:
    silent = [
        (call.title, reply.status)
        for call in calls_of(document)
        for reply in call.replies
        if not call.text or reply.text in ("", "Successful Response")
    ]
    assert silent == []


def test_every_parameter_and_every_field_of_a_request_is_described(document: dict[str, Any]) -> None:
    parameters = [
        (call.title, one.name) for call in calls_of(document) for one in call.parameters if not one.text
    ]
    fields = [
        (found.name, one.name)
        for found in objects_of(document)
        if found.name.endswith("Request")
        for one in found.members
        if not one.text
    ]
    assert parameters + fields == []


def test_every_object_of_a_request_says_what_is_required_and_what_defaults_are(
    document: dict[str, Any],
) -> None:
    tables = {found.name: list(found.table()) for found in objects_of(document)}
    sent = {name: rows for name, (header, *rows) in tables.items() if "default" in header}
    defaults = {name: {field: default for field, _, default, _ in rows} for name, rows in sent.items()}
    assert set(defaults) >= {name for name in tables if name.endswith("Request")}
    assert set(defaults).isdisjoint({"Job", "Quote", "ComparisonAnswer", "ProblemDocument"})
    assert defaults["TargetQuality"] == {
        "`mode`": "`target`",
        "`error`": "required",
        "`confidence`": "`0.95`",
        "`time_limit`": "optional",
        "`precision`": "`single`",
    }
    schemas = document["components"]["schemas"]
    assert {
        (name, field.strip("`"))
        for name, fields in defaults.items()
        for field, default in fields.items()
        if default == "required"
    } == {(name, field) for name in defaults for field in schemas[name].get("required", ())}


def test_every_code_that_a_client_can_get_is_documented(document: dict[str, Any]) -> None:
    documented = {code for call in calls_of(document) for reply in call.replies for code in reply.codes}
    documented |= {code for reply in shared_replies(document) for code in reply.codes}
    public = {kind.code for kind in problems.KINDS.values() if kind.is_public}
    assert documented <= {kind.code for kind in problems.KINDS.values()}
    assert public - documented - WHOLE_SERVICE - OF_HTTP_ITSELF == CAUGHT
    template = http.TEMPLATE.read_text(encoding="utf-8")
    assert [code for code in sorted(WHOLE_SERVICE) if f"`{code}`" not in template] == []


def test_ids_and_times_of_a_response_are_replaced_and_equal_ids_stay_equal() -> None:
    masked: dict[str, str] = {}
    text = "0123456789abcdef at 2020-01-01T00:00:00.5Z, fedcba9876543210, 0123456789abcdef"
    first, second, third = re.findall(r"[0-9a-f]{16}", shown := http_examples.mask(text, masked))
    assert first == third != second
    assert not {"0123456789abcdef", "2020-01-01"} & {first, second, shown[20:30]}


@pytest.mark.parametrize("room", [12, 24, 40, 80])
def test_a_long_value_is_cut_at_the_width_of_the_page(room: int) -> None:
    value = {"name": "x" * 200, "list": list(range(100)), "deep": {"a": [{"b": 1}] * 30}}
    assert all(len(http_examples.shortened(part, room)) <= room for part in [value, *value.values()])
    assert "…" in http_examples.shortened(value, room)


def test_what_is_left_out_of_a_value_is_marked_where_it_was() -> None:
    value = {"a": [1, 2, 3, 4, 5, 6, 7], "b": "text"}
    assert http_examples.shortened(value, 24) == '{"a": [1, …], …}'
