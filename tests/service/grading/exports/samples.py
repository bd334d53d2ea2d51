"""Results to export, and hostile strings."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from schemas.api.comparisons import ComparisonRegion
from schemas.grading.grades import Grade, GradeImage, GradeInput, GradeTimings, GradeTool, Signal, TestGrade

FOR_STAFF = "found-on-the-web"
HIDDEN = "the-secret-one"

HOSTILE = (
    "<script>alert(1)</script>",
    "\"><img src=x onerror=alert(1)> & '",
    "]]><failure/>",
    "[[ATTACHMENT|/etc/passwd]]",
    "a | b\n| --- |\n# c `d` *e* ![f](http://example.org/g)",
    '=HYPERLINK("http://example.org","x")',
    "@SUM(A1:A2)",
    "\x00\x1b[31mred\x07\ud800\ufffe\u202e",
    "😀" * 50,
)

REGION = ComparisonRegion(
    x0=2, y0=3, x1=10, y1=9, share=0.75, rmse=0.2, brightness=-0.125, shape=1, name="ball"
)


def tried(test_id: str = "soft", **changes: Any) -> TestGrade:
    """A test, passed by default."""
    fields = {
        "id": test_id,
        "name": test_id.capitalize(),
        "kind": "image",
        "points": 10.0,
        "max_points": 10.0,
        "status": "passed",
        "message": "No pixel differs by more than rounding.",
        "verdict": "match",
        "metric": "bias_blocks",
        "value": 0.0,
        "threshold": 0.02,
    }
    return TestGrade.model_validate(fields | changes)


def failed(test_id: str = "phong", **changes: Any) -> TestGrade:
    """A test that lost all points."""
    fields = {
        "points": 0.0,
        "status": "failed",
        "verdict": "mismatch",
        "message": "The ball is missing.",
        "worst_regions": (REGION,),
    }
    return tried(test_id, **(fields | changes))


def not_gradable(name: str = "camera") -> TestGrade:
    """A test that could not be judged."""
    return tried(
        name,
        points=0.0,
        status="not_gradable",
        verdict="not_comparable",
        message="The picture has 20 x 20 pixels, the reference 32 x 24.",
        metric=None,
        value=None,
    )


def broken(name: str = "mesh") -> TestGrade:
    """A test whose reference is missing."""
    return tried(name, points=0.0, status="error", verdict=None, message="The reference is missing.")


def secret(test_id: str = HIDDEN, **changes: Any) -> TestGrade:
    """A hidden test."""
    fields = {"hidden": True, "points": 4.0, "status": "partial", "message": f"{HIDDEN} is wrong."}
    return tried(test_id, **(fields | changes))


def result(*tests: TestGrade, **changes: Any) -> Grade:
    """A whole result."""
    open_ = tuple(test.id for test in tests if test.status in {"error", "not_gradable"})
    fields = {
        "title": "Ray tracer",
        "student": "Zoë",
        "submitted": "2026-06-01T16:32:01+02:00",
        "gradable": len(open_) < len(tests),
        "ungraded": open_,
        "verdict": "not_comparable" if len(open_) == len(tests) else "mismatch",
        "score": sum(test.points for test in tests),
        "max_score": sum(test.max_points for test in tests if not test.bonus),
        "tests": tests,
        "signals": (Signal(test=tests[0].id, code="identical_bytes", message=FOR_STAFF),),
        "tool": GradeTool(version="1.0"),
        "timings": GradeTimings(seconds=2.5, cpu_seconds=2.0, started="2026-06-01T14:33:00+00:00"),
    }
    return Grade.model_validate(fields | changes)


def hostile() -> Grade:
    """A result whose untrusted strings are all from `HOSTILE`."""
    tests = [
        failed(
            f"test-{number}",
            name=words[:200],
            message=words,
            tags=(words,),
            worst_regions=(REGION.model_copy(update={"name": words}),),
        )
        for number, words in enumerate(HOSTILE)
    ]
    signals = [Signal(test="test-0", code="identical_bytes", message=words) for words in HOSTILE]
    return result(*tests, title=HOSTILE[0], student=" ".join(HOSTILE), signals=signals)


def many() -> Grade:
    """The largest number of tests in a manifest, each with the longest texts."""
    words = "😀" * 5000
    return result(*(failed(f"test-{number}", name="😀" * 200, message=words) for number in range(200)))


def drawn(folder: Path, grade: Grade, width: int, height: int) -> Grade:
    """The same result with a picture of noise for each test, which PNG cannot compress."""
    noise = np.random.default_rng(1).integers(0, 256, (height, width, 3), np.uint8)
    Image.fromarray(noise).save(folder / "noise.png")
    image = GradeImage(label="picture, reference, difference", file="noise.png")
    tests = [test.model_copy(update={"images": (image,)}) for test in grade.tests]
    inputs = [
        GradeInput(test=test.id, role="submission", name=f"{test.id}.png", sha256="ab" * 32, size=1, width=32)
        for test in tests
    ]
    return grade.model_copy(update={"tests": tuple(tests), "inputs": tuple(inputs)})
