"""Measure what noise, blurs and copies earn in the ready assignment, and how often staff gets a signal.

``python -m tools.docs.measure_noise`` takes about ten minutes in one process, and saves the figures of
docs/reference/comparing.md in docs/figures/noise.json. Names of scenes after it measure only those, and save
nothing.
"""

from __future__ import annotations

import io
import json
import sys
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from accuracy.comparison import picture_of
from accuracy.comparison.blurs import smoothed
from accuracy.study.journal import describe
from scenes.make_assignment_parts import FOLDER
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import ImageTest
from service.grading.accepting import accepted, compared
from service.grading.comparing import forgiven
from service.grading.folders import Folder
from service.grading.likeness.signals import signals
from service.grading.selection import select
from service.grading.wanted import read_picture
from tests.service.grading.assignment import noise, program
from tests.service.grading.assignment.tracer import Tracer, encoded
from tools.docs import figures

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from accuracy.comparison import Picture
    from service.grading.outcomes import Outcome
    from tests.service.grading.assignment.noise import Added
    from tests.service.grading.assignment.shapes import Array

SEEDS = 50
"""Honest pictures of each scene and number of samples: 600 of each number in all."""

SAMPLES = (4, 16, 64)

FEWEST = 4
"""Samples with which pictures are as noisy as the assignment allows."""

WRONG = {
    "half a pixel off": ("half_pixel_off",),
    "no ambient term": ("no_ambient",),
    "twice the shininess": ("shininess_doubled",),
    "hard shadows": ("hard_shadow",),
    "no anti-aliasing": ("one_sample",),
    "all five": ("half_pixel_off", "no_ambient", "shininess_doubled", "hard_shadow", "one_sample"),
}
"""Mistakes, alone and together."""

LITTLE = (0, 1, 2, 4)
"""Deviations of the noise added to copies of the reference, in codes of 255."""

BLURS = (0.6, 0.8, 1.0, 2.0)
"""Standard deviations of blurs, pixels."""


def main() -> None:
    """Measure the scenes named on the command line and print them, or measure, print and save all."""
    names = sys.argv[1:]
    tests = [test for test in image_tests() if not names or scene_of(test) in names]
    bench = Bench()
    found = {scene_of(test): measured(bench, test) for test in tests}
    print(json.dumps(found, indent=1))
    if not names:
        document = {"machine": describe(), "seeds": SEEDS, "scenes": found}
        (figures.FOLDER / "noise.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def image_tests() -> list[ImageTest]:
    """Tests of the ready assignment that compare pictures, each once."""
    tests = {}
    for name in ("manifest.yaml", "manifest-pictures.yaml"):
        manifest = read_manifest((FOLDER / name).read_bytes(), yaml=True)
        tests |= {test.id: test for test in manifest.tests if isinstance(test, ImageTest)}
    return list(tests.values())


def scene_of(test: ImageTest) -> str:
    """The name of the submitted file without its ending."""
    return test.submitted.file.removesuffix(".png")


class Bench:
    """The grader of pictures, with each reference read once."""

    def __init__(self) -> None:
        self._references: dict[str, Picture] = {}

    def reference(self, test: ImageTest) -> Picture:
        """The reference of a test."""
        if test.id not in self._references:
            folder = Folder(FOLDER.resolve(), "reference")
            self._references[test.id] = read_picture(folder, test.reference.file, "linear")[1]
        return self._references[test.id]

    def grade(self, test: ImageTest, codes: Array) -> Outcome:
        """What a picture of 8-bit codes earns, before mistakes are reproduced with the scene."""
        content = io.BytesIO()
        Image.fromarray(codes).save(content, "PNG", compress_level=1)
        image = picture_of(content.getvalue(), test.submitted.file, test.submitted.encoding)
        reference = self.reference(test)
        whole = compared(test.accept, image, reference)
        judged, pardon = forgiven(test.accept, whole)
        found = compared(test.accept, judged, reference) if pardon else whole
        outcome = accepted(test.accept, found, select(reference, None, None))
        return replace(
            outcome,
            diagnosis=whole.causes,
            signals=signals(content.getvalue(), None, whole, test=test.id),
        )


def codes_of(test: ImageTest, linear: Array) -> Array:
    """The codes of a linear picture as the test reads them."""
    if test.submitted.encoding == "srgb":
        return encoded(linear)
    return np.round(255 * np.clip(linear, 0, 1)).astype(np.uint8)


def measured(bench: Bench, test: ImageTest) -> dict[str, Any]:
    """All figures of one test."""
    print(f"{scene_of(test)} ...", file=sys.stderr, flush=True)
    return {
        "honest": [honest(bench, test, samples) for samples in SAMPLES],
        "wrong": [] if scene_of(test).endswith("_normals") else list(wrong(bench, test)),
        "blurs": list(blurs(bench, test)) if scene_of(test).startswith("antialiasing") else [],
        "copies": [copies(bench, test, codes) for codes in LITTLE],
    }


def honest(bench: Bench, test: ImageTest, samples: int) -> dict[str, Any]:
    """How many correct pictures lose points, and how many give a signal."""
    outcomes = [
        bench.grade(test, codes_of(test, noise.honest(scene_of(test), samples, seed)))
        for seed in range(SEEDS)
    ]
    return {
        "samples": samples,
        "lost": sum(outcome.share < 1 for outcome in outcomes),
        "messages": Counter(outcome.message for outcome in outcomes if outcome.share < 1).most_common(3),
        "signals": flagged(outcomes),
    }


def flagged(outcomes: Iterable[Outcome]) -> dict[str, int]:
    """How many pictures give each signal."""
    return dict(Counter(code for outcome in outcomes for code in {each.code for each in outcome.signals}))


def wrong(bench: Bench, test: ImageTest) -> Iterator[dict[str, Any]]:
    """What pictures with mistakes earn without noise, and with each kind of noise that earns more."""
    name, reference = scene_of(test), bench.reference(test).linear
    for words, mistakes in WRONG.items():
        tracer = Tracer(program.read(FOLDER, name), FOLDER, frozenset(mistakes))
        linear, few = tracer.picture(), tracer.picture(FEWEST)
        plain = bench.grade(test, encoded(linear))
        tried = {kind: bench.grade(test, encoded(picture)) for kind, picture in noisy(linear, reference)}
        tried[f"{FEWEST} samples"] = bench.grade(test, encoded(few))
        yield {
            "mistake": words,
            "points": test.points * plain.share,
            "more": {
                kind: test.points * each.share for kind, each in tried.items() if each.share > plain.share
            },
            "signals": flagged(tried.values()),
            "pictures": len(tried),
        }


def noisy(linear: Array, reference: Array) -> Iterator[tuple[str, Array]]:
    """A wrong picture with each kind of noise, everywhere and only where it is wrong."""
    random = np.random.default_rng(1)
    off = np.abs(smoothed(linear - reference, 2.0)).max(axis=2) > 0.01
    added: Mapping[str, Added] = noise.KINDS | {
        f"Gaussian {deviation:g} where it is wrong": noise.where(off, noise.gaussian(deviation))
        for deviation in (0.05, 0.1, 0.2)
    }
    for kind, add in added.items():
        yield kind, add(linear, random)


def blurs(bench: Bench, test: ImageTest) -> Iterator[dict[str, Any]]:
    """What blurred pictures of one sample in the middle of each pixel earn, and of 16 random samples."""
    one = Tracer(program.read(FOLDER, scene_of(test)), FOLDER, frozenset(["one_sample"])).picture()
    for words, linear in (("one sample", one), ("16 samples", noise.honest(scene_of(test), 16, 0))):
        for width in BLURS:
            found = bench.grade(test, codes_of(test, smoothed(linear, width)))
            yield {
                "picture": words,
                "width": width,
                "share": found.share,
                "causes": [cause.cause for cause in found.diagnosis],
            }


def copies(bench: Bench, test: ImageTest, deviation: int) -> dict[str, Any]:
    """How many copies of the reference with a little noise give a signal."""
    codes = codes_of(test, bench.reference(test).linear).astype(np.float64)
    outcomes = []
    for seed in range(10 if deviation else 1):
        random = np.random.default_rng([seed, deviation])
        copy = np.clip(np.rint(codes + deviation * random.standard_normal(codes.shape)), 0, 255)
        outcomes.append(bench.grade(test, copy.astype(np.uint8)))
    return {
        "deviation": deviation,
        "pictures": len(outcomes),
        "flagged": sum(bool(outcome.signals) for outcome in outcomes),
        "signals": flagged(outcomes),
    }


if __name__ == "__main__":
    main()
