"""Points that staff set, and those that lateness costs."""

from fractions import Fraction

import pytest

from schemas.grading.grades import Grade
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import Manifest
from service.grading import results
from service.grading.adjustments import read_corrections
from service.grading.errors import AdjustmentError
from service.grading.outcomes import Outcome
from service.grading.processes import Finished
from tests.service.grading.assignments import Assignment, image_test, scene_test, time_test
from tests.service.grading.exports.samples import result, tried

DEADLINE = "2026-11-21T23:59:00+01:00"
HEADER = b"student,test,points,reason\n"


def manifest(assignment: Assignment, **late: object) -> Manifest:
    tests = image_test(), scene_test(points=90), time_test(requires=["scene"], bonus=True, accept={"full": 1})
    members = {"late": {"deadline": DEADLINE} | late} if late else {}
    return read_manifest(assignment.manifest(*tests, **members).read_bytes(), yaml=False)


def grade(read: Manifest, *shares: float, submitted: str | None = None, corrections: bytes = HEADER) -> Grade:
    outcomes = [Finished(Outcome(share=share, message="It was seen.")) for share in shares]
    tests = [results.tested(test, outcome) for test, outcome in zip(read.tests, outcomes, strict=True)]
    rows = read_corrections(corrections, read)
    return results.graded(read, tests, result(tried()).timings, submitted=submitted, corrections=rows)


@pytest.mark.parametrize(
    ("submitted", "days", "lost"),
    [
        ("2026-11-21T23:59:00+01:00", 0, 0),
        ("2026-11-22T00:14:00", 0, 0),
        ("2026-11-22T00:14:01", 1, 10),
        ("2026-11-21T23:14:01Z", 1, 10),
        ("2026-11-22T23:59:00+01:00", 1, 10),
        ("2026-11-22T23:59:01+01:00", 2, 20),
        ("2026-11-25T00:00:00+01:00", 4, 35),
        (None, 0, 0),
    ],
)
def test_lateness_costs_a_share_of_the_full_score_for_each_day_begun(
    assignment: Assignment, submitted: str | None, days: int, lost: float
) -> None:
    read = manifest(assignment, per_day=0.1, most=0.35, grace=15)
    found = grade(read, 1, 0.5, 0, submitted=submitted)
    assert [test.points for test in found.tests] == [10, 45, 0]
    assert (found.score, found.earned) == (float(55 - Fraction(lost)), 55)
    assert (found.late.days if found.late else 0) == days
    assert grade(read, 1, 0, 0, submitted="2026-12-21T00:00:00Z").score == 0


def test_points_of_staff_win_over_tests_and_requirements(assignment: Assignment) -> None:
    read = manifest(assignment)
    rows = HEADER + 'zoë,scene,90,Agreed\nzoë,picture,2.5,"Copied, see note"\n'.encode()
    found = grade(read, 1, 0, 1, corrections=rows)
    assert [(test.points, test.status) for test in found.tests] == [
        (2.5, "partial"),
        (90, "passed"),
        (10, "passed"),
    ]
    before = found.tests[0].override
    assert before is not None
    assert (before.points, before.status, before.reason) == (10, "passed", "Copied, see note")
    # Without the scene, time earns nothing, unless staff say so.
    late = HEADER + b"a,time,4,Fast\n"
    assert [test.points for test in grade(read, 1, 0, 1, corrections=late).tests] == [10, 0, 4]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"student,test,points\n", "lacks reason"),
        (b"", "lacks student"),
        (HEADER + b"a,scen,1,x\n", "line 2: no test has the id 'scen'"),
        (HEADER + b"a,scene,1,x\na,scene,2,y\n", "line 3"),
        (HEADER + b"a,scene,91,x\n", "from 0 to 90"),
        (HEADER + b"a,scene,nan,x\n", "from 0 to 90"),
        (HEADER + b"a,scene,1\n", "a reason"),
        (HEADER + b"\xff,scene,1,x\n", "UTF-8"),
    ],
)
def test_unusable_corrections_are_refused(assignment: Assignment, content: bytes, said: str) -> None:
    with pytest.raises(AdjustmentError, match=said):
        read_corrections(content, manifest(assignment))
