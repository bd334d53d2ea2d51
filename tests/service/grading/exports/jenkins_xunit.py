"""JUnit XML by the published rules of junit-10.xsd, the schema of Jenkins' xUnit plugin."""

import re
from collections.abc import Iterator
from xml.etree.ElementTree import Element

TIME = re.compile(r"(([0-9]{0,3},)*[0-9]{3}|[0-9]{0,3})*(\.[0-9]*)?")
TEXTS = {"failure", "error", "skipped", "system-out", "system-err"}

# Of each element the required and the optional attributes, and its children.
RULES = {
    "testsuites": ("", "name time tests failures errors", "testsuite"),
    "testsuite": (
        "name tests failures errors",
        "group time skipped timestamp hostname id package file log url",
        "testsuite properties testcase system-out system-err",
    ),
    "properties": ("", "", "property"),
    "property": ("name value", "", ""),
    "testcase": (
        "name",
        "time classname group",
        "skipped error failure rerunFailure rerunError flakyFailure flakyError system-out system-err",
    ),
    **dict.fromkeys(("failure", "error", "skipped"), ("", "type message", "")),
}


def faults(root: Element) -> Iterator[str]:
    """Everything that the schema refuses."""
    if root.tag not in {"testsuites", "testsuite"}:
        yield f"the root is {root.tag}"
    for element in root.iter():
        required, optional, children = (set(part.split()) for part in RULES.get(element.tag, ("", "", "")))
        found = {*element.attrib}
        yield from (f"{element.tag} has no {name}" for name in required - found)
        yield from (f"{element.tag} has the attribute {name}" for name in found - required - optional)
        yield from (f"{element.tag} contains {each.tag}" for each in element if each.tag not in children)
        between = [element.text, *(child.tail for child in element)]
        if element.tag not in TEXTS and any(text and text.strip() for text in between):
            yield f"{element.tag} contains words"
        if element.tag.startswith("testsuite") and not TIME.fullmatch(element.attrib.get("time", "")):
            yield f"{element.tag} has the time {element.attrib['time']}"
