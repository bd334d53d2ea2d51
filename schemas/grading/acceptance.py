"""Thresholds of a test, and partial credit below them."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from schemas.api.comparisons import Share
from schemas.base import Closed, chosen_by, tag
from schemas.quantities import WHOLE

Threshold = Annotated[float, Field(strict=True, ge=0, le=1e9, allow_inf_nan=False)]
SampleCount = Annotated[int, Field(strict=True, ge=1, le=1_000_000), WHOLE]
MetricName = Literal["mse", "rmse", "psnr", "relmse", "ssim", "max_abs", "frac_over", "bias_blocks", "flip"]

HIGHER_IS_BETTER = frozenset({"psnr", "ssim"})
"""Metrics that grow as pictures get closer."""

_PLACES = ("left_up", "left", "left_down", "up", "down", "right_up", "right", "right_down")

PICTURE_MISTAKES = (
    "antialiasing_missing",
    "averaged_after_encoding",
    "blurred",
    "channels_bgr",
    "channels_brg",
    "channels_gbr",
    "channels_grb",
    "channels_rbg",
    "exposure",
    "flipped_horizontally",
    "flipped_vertically",
    "gamma_2.2",
    "gamma_missing",
    "gamma_twice",
    *(f"half_pixel_{place}" for place in _PLACES),
    "lossy_compression",
    *(f"one_pixel_{place}" for place in _PLACES),
    "pixel_filter",
    "tone_mapped_aces",
    "tone_mapped_exponential",
    "tone_mapped_luminance",
    "tone_mapped_reinhard",
    "transposed",
    "turned_half",
)
"""Mistakes with a whole picture that can be undone."""


def _known(cause: str) -> str:
    if cause not in PICTURE_MISTAKES:
        raise PydanticCustomError(
            "unknown_mistake",
            "No such mistake can be undone; docs/reference/comparing.md lists those that can.",
            {"names": PICTURE_MISTAKES},
        )
    return cause


PictureMistake = Annotated[str, Field(strict=True), AfterValidator(_known)]


class Band(Closed):
    """A step of partial credit."""

    at: Threshold = Field(description="A value this good or better earns `share`.")
    share: Share = Field(description="Share of the points, 0 to 1.")


class Scale(Closed):
    """Turns a number into a share of the points: all at `full`, then linear down to `zero`, or in `bands`.

    Without `zero` and `bands` a number earns all or nothing. A number that misses a threshold only by
    rounding reaches it.
    """

    full: Threshold = Field(description="A value this good or better earns all points.")
    zero: Threshold | None = Field(
        default=None,
        description="A value this bad or worse earns none; between `full` and this, points are linear.",
    )
    bands: tuple[Band, ...] = Field(
        default=(), description="Steps instead of `zero`, from good to bad; worse than the last earns none."
    )

    @property
    def rising(self) -> bool:
        """Whether more is better."""
        return False

    @model_validator(mode="after")
    def _descend(self) -> Scale:
        if self.zero is not None and self.bands:
            raise PydanticCustomError("two_scales", "Give 'zero' or 'bands', not both.")
        thresholds = [self.full, *(band.at for band in self.bands)]
        if self.zero is not None:
            thresholds.append(self.zero)
        sign = -1 if self.rising else 1
        if any(sign * worse <= sign * better for better, worse in pairwise(thresholds)):
            raise PydanticCustomError(
                "not_in_order",
                "These thresholds must go from good to bad, and here {more} is better: first 'full', then "
                "the bands or 'zero'.",
                {"more": "more" if self.rising else "less"},
            )
        shares = [1.0, *(band.share for band in self.bands)]
        if any(after > before for before, after in pairwise(shares)):
            raise PydanticCustomError(
                "not_in_order", "The shares of the bands must not grow from good to bad."
            )
        return self


class Verdict(Scale):
    """Whether the pictures agree apart from noise; `full` is the share of blocks that may be biased.

    With `zero` or `bands` this share decides, even if the noise is known.
    """

    by: Literal["verdict"] = Field(description="`verdict`.")
    full: Share = Field(
        default=0.02,
        description="Share of blocks of 8 x 8 pixels that may be biased if the noise is not known.",
    )
    tolerance: Share = Field(
        default=0.01, description="Linear difference of a block's mean that is always tolerated."
    )
    samples: SampleCount | Literal["any"] | None = Field(
        default=None,
        description="Fewest random samples of a pixel: a picture noisier than theirs is not accepted, and "
        "noise excuses no more than theirs does. It needs a reference with the layers `error` and `samples`. "
        "By default 1 where the reference has them and 16 samples or more, else `any` noise is accepted.",
    )
    limit: Share = Field(default=0.05, description="Limit of the metric `frac_over`, in linear values.")
    diagnosed: Share = Field(
        default=0.0,
        description="Share of the points that remains if a single mistake explains everything.",
    )
    forgiven: tuple[PictureMistake, ...] = Field(
        default=(),
        description="Mistakes that another test covers: if the diagnosis finds one, the picture is judged "
        "with it undone.",
    )


class Metric(Scale):
    """One metric of the comparison."""

    by: Literal["metric"] = Field(description="`metric`.")
    metric: MetricName = Field(
        description="The metric: for `psnr` and `ssim` more is better, for all others less."
    )
    limit: Share = Field(default=0.05, description="Limit of the metric `frac_over`, in linear values.")
    tolerance: Share = Field(default=0.01, description="Tolerance of the metric `bias_blocks`.")

    @property
    def rising(self) -> bool:
        """Whether more is better."""
        return self.metric in HIGHER_IS_BETTER


class Error(Scale):
    """The RMSE without the noise of the reference, which its layer `error` gives."""

    by: Literal["error"] = Field(description="`error`.")


Acceptance = Annotated[
    Annotated[Verdict, tag(Verdict)] | Annotated[Metric, tag(Metric)] | Annotated[Error, tag(Error)],
    chosen_by({"verdict": (Verdict,), "metric": (Metric,), "error": (Error,)}, field="by"),
]
"""Requirement on a picture."""


class RayShare(Scale):
    """Share of rays that agree; rays whose hit depends on rounding do not count."""

    full: Share = Field(default=0.99, description="This share or more earns all points.")

    @property
    def rising(self) -> bool:
        """Whether more is better."""
        return True


class CpuSeconds(Scale):
    """CPU seconds of a render, all its processes together."""
