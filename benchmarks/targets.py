"""Whether random pictures reach their target error, and estimate their error correctly."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

import renderer
from accuracy.statistics import clipped
from accuracy.variations import fixed_quality
from benchmarks.everyday_scenes import everyday_scene, files
from benchmarks.machine import timed_render
from schemas.quality import TargetQuality

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    from accuracy.hard_cases.documents import Json

SETS = {"fresh": (20270401, 20), "developed": (20261122, 40)}
"""Number of the first scene of each set, and how many there are: consecutive, so that none of them is chosen.
Failures of those in `developed` have led to changes of the renderer, those in `fresh` to none."""

TARGETS_255 = (2.0, 1.0, 0.5)
"""Target errors, in units of 1/255."""

CONVERGED = fixed_quality("sobol", 256, "sobol", 4)
"""Of each picture that a reference is the mean of: textures with a filter are blurred as for 256 samples."""

SURE, MOST_ROUNDS = 0.1, 4
"""Standard error of a squared true error over the squared target, from which on references are good enough,
and the most pictures that half of a reference is the mean of."""


@dataclass(slots=True, eq=False)
class Reference:
    """Two independent means of converged pictures of a scene, refined as long as an error needs it.

    Attributes
    ----------
    document : dict
        The scene.
    folder : Path or None
        Where its pictures are kept between runs.
    """

    document: Json
    folder: Path | None = None

    def halves(self, rounds: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Means (H, W, 3) of `rounds` pictures each, clipped to 0..1."""
        first, second = (
            np.mean([self._picture(2 * turn + half) for turn in range(rounds)], axis=0) for half in (1, 2)
        )
        return clipped(first), clipped(second)

    def error_of(self, image: ArrayLike, target: float) -> tuple[float, float]:
        """True RMSE of an image and the standard error of its square over the squared target.

        What clipped differences from the halves have in common is the image's own error, without bias.
        """
        for rounds in range(1, MOST_ROUNDS + 1):
            first, second = (clipped(image) - half for half in self.halves(rounds))
            own, noise = (first + second) / 2, (first - second) / 2
            squares = (2 * (own * noise).mean(axis=2)) ** 2 + 2 * (noise**2).mean(axis=2) ** 2
            doubt = float(np.sqrt(squares.sum()) / squares.size / target**2)
            if doubt <= SURE:
                break
        return root_of_product(first, second), doubt

    def _picture(self, seed: int) -> NDArray[np.float32]:
        """One converged picture; no scene has such a low seed itself."""
        known = f"{self.document['name']}-{zlib.crc32(repr(self.document).encode()):08x}-{seed}.npy"
        path = self.folder / known if self.folder else None
        if path and path.exists():
            found: NDArray[np.float32] = np.load(path)
            return found
        seeded = self.document | {"sampling": self.document["sampling"] | {"seed": seed}}
        image = renderer.render(renderer.compile_scene(loaded(seeded), CONVERGED)).image
        if path:
            np.save(path, image)
        return image


class Pair(TypedDict):
    """A scene at a target; errors are those of linear values clipped to 0..1 in units of 1/255.

    `estimate`, `low` and `high` are what the picture reports, `true` is what the reference says; `doubt` is
    the standard error of the square of `true`, over the square of the target. `samples` are camera rays a
    pixel.
    """

    scene: str
    target: float
    estimate: float
    low: float
    high: float
    true: float
    doubt: float
    samples: float
    cpu_seconds: float


class Summary(TypedDict):
    """How many pairs there are, how many reached the target, and how many intervals hold the true error.

    `ratios` are true errors over targets: the lowest tenth, the median and the highest tenth.
    """

    pairs: int
    kept: int
    held: int
    ratios: tuple[float, float, float]
    cpu_seconds: float


class Targets(TypedDict):
    """A set: the number of its first scene, how many scenes it has, all pairs, and what they come to."""

    first: int
    scenes: int
    pairs: list[Pair]
    summary: Summary


def measure() -> dict[str, Targets]:
    """Render every scene of every set at every target once, in one process."""
    return {name: _set(first, scenes) for name, (first, scenes) in SETS.items()}


def _set(first: int, scenes: int) -> Targets:
    pairs = [pair for number in range(first, first + scenes) for pair in pairs_of(number)]
    return Targets(first=first, scenes=scenes, pairs=pairs, summary=summary(pairs))


def pairs_of(
    number: int, targets: Iterable[float] = TARGETS_255, folder: Path | None = None, scale: float = 1.0
) -> list[Pair]:
    """Render an everyday scene at some targets (in 1/255), and compare each picture with the reference.

    Sides of the picture are `scale` times those of the scene; a `folder` keeps references between runs.
    """
    document = everyday_scene(number)
    sizes = {name: round(scale * document["camera"][name]) for name in ("width", "height")}
    document["camera"] |= sizes
    reference = Reference(document, folder)
    return [_pair(document, target, reference) for target in targets]


def summary(pairs: list[Pair]) -> Summary:
    """What pairs come to."""
    ratios = [pair["true"] / pair["target"] for pair in pairs]
    low, middle, high = (round(float(np.quantile(ratios, share)), 3) for share in (0.1, 0.5, 0.9))
    return Summary(
        pairs=len(pairs),
        kept=sum(ratio <= 1 for ratio in ratios),
        held=sum(pair["low"] <= pair["true"] <= pair["high"] for pair in pairs),
        ratios=(low, middle, high),
        cpu_seconds=round(sum(pair["cpu_seconds"] for pair in pairs), 2),
    )


def loaded(document: Json) -> Any:
    """An everyday scene with its files."""
    return renderer.load_scene(document, assets=files())


def _pair(document: Json, target: float, reference: Reference) -> Pair:
    plan = renderer.compile_scene(loaded(document), TargetQuality(mode="target", error=target / 255))
    result, seconds = timed_render(plan)
    known = {name: round(255 * value, 4) for name, value in result.report["error"].items()}
    true, doubt = reference.error_of(result.image, target / 255)
    return Pair(
        scene=document["name"],
        target=target,
        estimate=known["estimate"],
        low=known["low"],
        high=known["high"],
        true=round(255 * true, 4),
        doubt=round(doubt, 3),
        samples=round(result.report["samples"]["antialiasing_mean"], 2),
        cpu_seconds=round(seconds, 3),
    )


def root_of_product(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Root mean square of what two differences have in common.

    The two are of one picture from two references. Their own errors know nothing of each other, so in the
    mean of the products they leave no bias.

    Examples
    --------
    >>> root_of_product(np.array([3.0, -2.0]), np.array([1.0, -0.5]))
    1.4142135623730951
    """
    return float(np.sqrt(max(float(np.mean(first * second)), 0.0)))
