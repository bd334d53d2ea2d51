"""Target errors of random scenes, kept or missed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import renderer
from accuracy.statistics import clipped
from accuracy.variations import fixed_quality
from benchmarks.everyday_scenes import everyday_scene, files
from benchmarks.report import Json, keep, parser, show
from schemas.quality import TargetQuality

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray

FIRST = 20270401
"""Number of the first scene; the others follow it, so that none is chosen."""
TARGETS_255 = (2.0, 1.0, 0.5)
CONVERGED = fixed_quality("sobol", 256, "sobol", 4)
"""Of each picture that a reference is the mean of."""
DOUBT, MOST_ROUNDS = 0.1, 4
"""Standard error of a squared true error over the squared target, from which on references are good enough,
and the most pictures that half of a reference is the mean of."""


class Reference:
    """Two independent means of converged pictures of a scene, refined as long as an error needs it."""

    def __init__(self, document: Json) -> None:
        self.document = document
        self._pictures: dict[int, NDArray[np.float32]] = {}

    def error_of(self, image: ArrayLike, target: float) -> float:
        """True RMSE of an image: what its differences from the halves have in common, without bias."""
        for rounds in range(1, MOST_ROUNDS + 1):
            first, second = (clipped(image) - self._half(half, rounds) for half in (1, 2))
            own, noise = (first + second) / 2, (first - second) / 2
            squares = (2 * (own * noise).mean(axis=2)) ** 2 + 2 * (noise**2).mean(axis=2) ** 2
            if float(np.sqrt(squares.sum())) / squares.size / target**2 <= DOUBT:
                break
        return float(np.sqrt(max(float(np.mean(first * second)), 0.0)))

    def _half(self, half: int, rounds: int) -> NDArray[np.float64]:
        """The mean of so many pictures, clipped to 0..1."""
        return clipped(np.mean([self._picture(2 * turn + half) for turn in range(rounds)], axis=0))

    def _picture(self, seed: int) -> NDArray[np.float32]:
        """One converged picture; no scene has such a low seed itself."""
        if seed not in self._pictures:
            seeded = self.document | {"sampling": self.document["sampling"] | {"seed": seed}}
            self._pictures[seed] = renderer.render(renderer.compile_scene(loaded(seeded), CONVERGED)).image
        return self._pictures[seed]


def loaded(document: Json) -> Any:
    """An everyday scene with its files."""
    return renderer.load_scene(document, assets=files())


def pictures_of(number: int) -> Iterator[dict[str, Any]]:
    """Render a scene at every target; errors are RMSE x 255, `true` by comparison with the reference."""
    document = everyday_scene(number)
    reference = Reference(document)
    for target in TARGETS_255:
        quality = TargetQuality(mode="target", error=target / 255)
        result = renderer.render(renderer.compile_scene(loaded(document), quality))
        known = {name: 255 * value for name, value in result.report["error"].items()}
        true = 255 * reference.error_of(result.image, target / 255)
        yield {"scene": document["name"], "target": target, **known, "true": true}


def main() -> None:
    """Render every scene at every target; print and keep what was reached."""
    options = parser("targets", __doc__)
    options.add_argument("--scenes", type=int, default=20, help="how many; 20 by default")
    numbers = range(FIRST, FIRST + options.parse_args().scenes)
    found = [picture for number in numbers for picture in pictures_of(number)]
    ratios = [each["true"] / each["target"] for each in found]
    reached = sum(ratio <= 1 for ratio in ratios)
    inside = sum(each["low"] <= each["true"] <= each["high"] for each in found)
    columns = ("pictures", "reached", "interval holds", "true / target, median")
    show("Targets", columns, [(len(found), reached, inside, float(np.median(ratios)))])
    keep("targets", found)


if __name__ == "__main__":
    main()
