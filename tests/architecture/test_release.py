"""What a release says of itself in several files is the same in all of them; forms for issues are valid."""

import re
import tomllib
from datetime import date
from pathlib import Path

import pytest
import yaml

from tests.architecture.sources import ROOT

FORMS = sorted(path for path in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml") if path.stem != "config")
RELEASE = re.compile(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$", re.MULTILINE)


def releases() -> list[tuple[str, str]]:
    """Version and date of each release of the changelog, the newest first."""
    return RELEASE.findall((ROOT / "CHANGELOG.md").read_text())


def test_the_package_the_changelog_and_the_citation_name_one_version_and_one_date() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    version, day = releases()[0]
    assert project["version"] == citation["version"] == version
    assert citation["date-released"] == date.fromisoformat(day)
    assert project["license"] == citation["license"]


def test_a_citation_has_what_its_format_requires() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["cff-version"] == "1.2.0"
    assert set(citation) >= {"message", "title", "authors"}
    assert all(author["name"] for author in citation["authors"])


def test_the_changelog_begins_with_what_is_not_released_and_goes_back_in_time() -> None:
    headings = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert headings[0] == "[Unreleased]"
    assert len(releases()) == len(headings) - 1
    days = [day for _, day in releases()]
    assert days == sorted(days, reverse=True)


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_a_form_for_issues_is_one_that_github_shows(path: Path) -> None:
    form = yaml.safe_load(path.read_text())
    assert set(form) == {"name", "description", "labels", "body"}
    fields = [field for field in form["body"] if field["type"] != "markdown"]
    assert {field["type"] for field in fields} <= {"input", "textarea", "dropdown", "checkboxes"}
    ids = [field["id"] for field in fields]
    assert len(ids) == len(set(ids)) > 0
    assert all(field["attributes"]["label"] for field in fields)
    assert any(field.get("validations", {}).get("required") for field in fields)
