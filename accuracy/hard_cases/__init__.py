"""Hard cases: inputs that plain formulas get wrong, and the count of wrong answers.

Not part of rendering: nothing here is imported by it. Every case asks the renderer, knows the right answers
from exact arithmetic or closed forms, and asks the textbook's formula the same.
`tools/docs/numerics_cases.toml` says what each case is about: what users see, why, and what is done.
"""

from importlib import import_module

from accuracy.hard_cases.harness import Case, Cases, Outcome, Section, section

__all__ = ["Case", "Outcome", "Section", "section", "sections"]

SECTIONS = {
    "Cameras": ("cameras",),
    "Triangles": ("triangles",),
    "Rectangles": ("rectangles",),
    "Ellipsoids": ("ellipsoids",),
    "Shadows and light": ("shadows.occluders", "shadows.seams", "shadows.lights"),
    "The Phong model": ("phong",),
    "Textures, normal maps, displacement": ("textures.lookups", "textures.normal_maps", "textures.relief"),
    "Trees, mirrors and glass": ("trees_and_bounces.trees", "trees_and_bounces.bounces"),
    "Samples, sums, output": ("samples_and_output.samples", "samples_and_output.output"),
    "Scene values and units": ("scene_values.values", "scene_values.pictures"),
}
"""The modules with the cases of each section, in the order of the catalogue: A to J."""


def sections() -> tuple[Section, ...]:
    """All sections, imported on demand."""
    return tuple(section(title, *map(_cases, modules)) for title, modules in SECTIONS.items())


def _cases(module: str) -> Cases:
    cases: Cases = import_module(f"accuracy.hard_cases.{module}").CASES
    return cases
