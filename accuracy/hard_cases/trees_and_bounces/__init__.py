"""Hard cases H: trees of boxes, mirrors and glass."""

from accuracy.hard_cases.harness import gathered
from accuracy.hard_cases.trees_and_bounces import bounces, coplanar, trees

PARTS = (trees, coplanar, bounces)

SECTION = gathered("Trees, mirrors and glass", *(part.SECTION for part in PARTS))
