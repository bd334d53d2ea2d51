"""Hard cases: arithmetic that is faster than IEEE arithmetic, and breaks what rests on it."""

from fractions import Fraction

import numpy as np

import renderer
from accuracy.hard_cases.cases import Outcome, Section
from accuracy.hard_cases.documents import scene, triangle
from renderer.math.arrays import Floats

SECTION = Section("Fast arithmetic")

PAIRS, RAYS = 60, 20


def fused(a: float, b: float, c: float) -> float:
    """Product and sum a * b + c with one rounding, as a fused multiply-add gives them."""
    return float(Fraction(a) * Fraction(b) + Fraction(c))


def fused_edge(p: Floats, q: Floats) -> float:
    """The product p x q as compilers may write it: one product is rounded, the other is not."""
    return fused(float(p[0]), float(q[1]), -float(p[1] * q[0]))


def meets(triangle_: Floats, origin: Floats, direction: Floats) -> bool:
    """Woop's test of a triangle (3, 3), with fused edge functions."""
    axis = int(np.argmax(np.abs(direction)))
    others = [(axis + 1) % 3, (axis + 2) % 3]
    relative = triangle_ - origin
    sheared = relative[:, others] - relative[:, axis, None] * (direction[others] / direction[axis])
    a, b, c = sheared
    weights = [fused_edge(c, b), fused_edge(a, c), fused_edge(b, a)]
    return min(weights) >= 0 or max(weights) <= 0


@SECTION.case(
    "fused products in edge functions",
    symptom="Dots of background along the edges of a mesh, on some machines only.",
    cause="A fused multiply-add rounds one of two products, so p x q is no longer -(q x p): two neighbours "
    "both take a ray on their common edge for outside.",
    remedy="Every product and difference is a NumPy call of its own, which rounds once: nothing is fused.",
    expected="Every ray at the common edge of two triangles hits one of them.",
    source="Woop, Benthin, Wald 2013, Watertight ray/triangle intersection",
)
def fused_products() -> Outcome:
    """Rays at places on the common edge of two triangles."""
    rng = np.random.default_rng(1)
    wrong = plain = 0
    for _ in range(PAIRS):
        a, b, c = rng.normal(size=(3, 3))
        across = b + c - a + 0.1 * rng.normal(size=3)
        normal = np.cross(b - a, c - a)
        targets = b + np.outer(rng.uniform(0.05, 0.95, RAYS), c - b)
        origins = targets + 3 * normal / np.linalg.norm(normal) + rng.normal(size=(RAYS, 3)) * 0.2
        directions = targets - origins
        pair = np.array([[a, b, c], [across, c, b]])
        document = scene(*(triangle(*corners.tolist()) for corners in pair))
        hits = renderer.trace(renderer.compile_scene(renderer.load_scene(document)), origins, directions)
        wrong += int(np.count_nonzero(hits.shape < 0))
        plain += sum(
            not any(meets(corners, *ray) for corners in pair) for ray in zip(origins, directions, strict=True)
        )
    return Outcome(PAIRS * RAYS, wrong, plain)
