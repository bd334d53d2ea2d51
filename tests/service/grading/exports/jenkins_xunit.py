"""What the xUnit plugin of Jenkins accepts as JUnit XML, by the published rules of its junit-10.xsd."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree.ElementTree import Element

TIME = re.compile(r"(([0-9]{0,3},)*[0-9]{3}|[0-9]{0,3})*(\.[0-9]*)?")


@dataclass(frozen=True)
class Rule:
    """Attributes and children of an element; `text` says whether it may hold words."""

    required: frozenset[str] = frozenset()
    optional: frozenset[str] = frozenset()
    children: frozenset[str] = frozenset()
    text: bool = False


def words(text: str) -> frozenset[str]:
    return frozenset(text.split())


REASON = Rule(optional=words("type message"), text=True)
RULES = {
    "testsuites": Rule(optional=words("name time tests failures errors"), children=words("testsuite")),
    "testsuite": Rule(
        required=words("name tests failures errors"),
        optional=words("group time skipped timestamp hostname id package file log url"),
        children=words("testsuite properties testcase system-out system-err"),
    ),
    "properties": Rule(children=words("property")),
    "property": Rule(required=words("name value")),
    "testcase": Rule(
        required=words("name"),
        optional=words("time classname group"),
        children=words(
            "skipped error failure rerunFailure rerunError flakyFailure flakyError system-out system-err"
        ),
    ),
    "failure": REASON,
    "error": REASON,
    "skipped": REASON,
    "system-out": Rule(text=True),
    "system-err": Rule(text=True),
}


def faults(root: Element) -> Iterator[str]:
    """Everything that the schema refuses."""
    if root.tag not in {"testsuites", "testsuite"}:
        yield f"the root is {root.tag}"
    for element in root.iter():
        yield from _of(element, RULES.get(element.tag, Rule()))


def _of(element: Element, rule: Rule) -> Iterator[str]:
    for name in sorted(rule.required - element.attrib.keys()):
        yield f"{element.tag} has no {name}"
    for name in sorted(element.attrib.keys() - rule.required - rule.optional):
        yield f"{element.tag} has the attribute {name}"
    for child in element:
        if child.tag not in rule.children:
            yield f"{element.tag} contains {child.tag}"
    between = [element.text, *(child.tail for child in element)]
    if not rule.text and any(text and text.strip() for text in between):
        yield f"{element.tag} contains words"
    if element.tag.startswith("testsuite") and not TIME.fullmatch(element.attrib.get("time", "")):
        yield f"{element.tag} has the time {element.attrib['time']}"
