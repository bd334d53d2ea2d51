"""Hard cases: inputs that plain formulas get wrong, and the count of wrong answers.

Not part of rendering: nothing here is imported by it. Every case asks the renderer, knows the right answers
from exact arithmetic or closed forms, and asks the textbook's formula the same.
"""

from importlib import import_module

from accuracy.hard_cases.harness import Case, Outcome, Section

__all__ = ["Case", "Outcome", "Section", "sections"]

MODULES = (
    "cameras",
    "triangles",
    "rectangles",
    "ellipsoids",
    "shadows",
    "phong",
    "textures",
    "trees_and_bounces",
    "samples_and_output",
    "scene_values",
)
"""One module or package a section, in the order of the catalogue: A to J."""


def sections() -> tuple[Section, ...]:
    """All sections, imported when asked for."""
    return tuple(import_module(f"accuracy.hard_cases.{name}").SECTION for name in MODULES)
