"""Requests and results of ``POST /v1/comparisons``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from schemas.base import Closed, Message

Encoding = Literal["srgb", "linear"]
Share = Annotated[float, Field(strict=True, ge=0, le=1)]


class SentPicture(Closed):
    """A picture of a job that has succeeded, an uploaded file, or a file in the request: one of them."""

    job: str | None = Field(
        default=None, max_length=64, description="The id of a job; its `error` and `samples` layers are used."
    )
    asset: str | None = Field(
        default=None,
        max_length=71,
        description="An uploaded PNG, NPY or EXR file, `sha256:` and its SHA-256: for pictures that make the "
        "request too large.",
    )
    content: str | None = Field(default=None, description="A PNG, NPY or EXR file in Base64.")
    encoding: Encoding | None = Field(
        default=None,
        description="What the numbers of the file mean. By default `srgb` for PNG and `linear` for "
        "floating point; the response says so.",
    )


class ComparisonRequest(Closed):
    """The body of ``POST /v1/comparisons``."""

    image: SentPicture = Field(description="The picture in question.")
    reference: SentPicture = Field(description="What it should look like.")
    tolerance: Share = Field(
        default=0.01, description="Linear difference of a block's mean that is always tolerated."
    )
    max_bias: Share = Field(
        default=0.02, description="Share of blocks that may differ by more than noise and tolerance."
    )
    limit: Share = Field(
        default=0.05, description="Linear difference above which `frac_over` counts a pixel."
    )
    flip: bool = Field(
        default=False, strict=True, description="Compute FLIP too; it takes longer than everything else."
    )
    pictures: bool = Field(
        default=False,
        strict=True,
        description="Return a heat map and a side-by-side picture too.",
    )


class ComparisonMetrics(Message):
    """Metrics of linear values clipped to 0..1, in float64; `ssim` and `flip` are of displayed values."""

    mse: float = Field(ge=0, description="Mean squared difference.")
    rmse: float = Field(ge=0, description="Its root.")
    psnr: float | None = Field(description="-10 log10 of `mse`, dB; null for equal pictures.")
    relmse: float = Field(ge=0, description="Mean of (a - b)^2 / (b^2 + 0.01).")
    max_abs: float = Field(ge=0, description="Largest difference.")
    frac_over: float = Field(ge=0, le=1, description="Share of pixels that differ by more than the limit.")
    ssim: float | None = Field(
        description="Mean structural similarity of BT.709 luma of sRGB values: Gaussian window of 11 x 11 "
        "pixels, sigma 1.5, population variances; null for pictures smaller than the window."
    )
    bias_blocks: float = Field(
        ge=0,
        le=1,
        description="Share of blocks of 8 x 8 pixels brighter or darker than noise and tolerance allow.",
    )
    flip: float | None = Field(
        description="Mean LDR-FLIP at 67 pixels per degree; null if it was not requested."
    )


class ComparisonCause(Message):
    """A mistake that explains most of the difference: undone, it leaves less than half, or noise alone."""

    cause: str = Field(description="A word for programs, such as `flipped_vertically`.")
    hint: str = Field(description="The probable mistake, and its cure.")
    rmse_before: float = Field(ge=0, description="`rmse` of all but the outermost pixels.")
    rmse_after: float = Field(ge=0, description="The same with the mistake undone, if it can be.")


class ComparisonRegion(Message):
    """A rectangle around blocks that touch each other and differ most; half open, rows from the top."""

    x0: int = Field(description="First column.")
    y0: int = Field(description="First row, from the top.")
    x1: int = Field(description="The column after the last.")
    y1: int = Field(description="The row after the last.")
    share: float = Field(ge=0, le=1, description="Share of the whole squared difference.")
    rmse: float = Field(ge=0, description="`rmse` over its blocks.")
    brightness: float = Field(description="Mean difference; above 0 the picture is too bright.")
    shape: int | None = Field(description="Index of the shape seen there; -1 for none, null if not known.")
    name: str | None = Field(description="Name of this shape.")


class ComparisonInput(Message):
    """A picture as it was read."""

    name: str = Field(description="Its name in messages.")
    sha256: str = Field(description="SHA-256 of the file.")
    width: int = Field(description="Pixels.")
    height: int = Field(description="Pixels.")
    encoding: Encoding = Field(description="What its numbers mean.")
    encoding_stated: bool = Field(
        description="Whether the request states the encoding; otherwise it is the default of the format."
    )
    bits: int = Field(description="Bits per channel; 32 or 64 for floating point.")
    clipped_pixels: int = Field(description="Pixels with a channel below 0 or above 1.")
    samples: float | None = Field(description="Mean camera samples per pixel; null if not known.")
    notes: tuple[str, ...] = Field(description="Conversions made on reading.")


class ComparisonInputs(Message):
    """Properties of both pictures, as read."""

    image: ComparisonInput = Field(description="The picture in question.")
    reference: ComparisonInput = Field(description="What it should look like.")


class ComparisonPolicy(Message):
    """Differences that are tolerated."""

    tolerance: float = Field(description="`tolerance` of the request.")
    most_bias: float = Field(description="`max_bias` of the request.")
    limit: float = Field(description="`limit` of the request.")
    single: bool = Field(description="Whether a single block that is far off is a mismatch.")
    samples: int | None = Field(
        description="Fewest random samples of a pixel, by which noise is bounded; always null."
    )


class ComparisonPictures(Message):
    """PNG files in Base64."""

    heat_map: str = Field(description="The largest displayed difference of any channel; white from 0.25 on.")
    side_by_side: str = Field(description="Picture, reference and heat map.")


class ComparisonAnswer(Message):
    """The result of a comparison."""

    model_config = ConfigDict(populate_by_name=True, serialize_by_alias=True)

    schema_: Literal["penumbra/comparison/v1"] = Field(
        alias="schema", description="The format of this document."
    )
    verdict: Literal["match", "noisy_match", "mismatch"] = Field(
        description="Equal up to rounding, equal up to noise, or different."
    )
    score: float = Field(ge=0, le=1, description="1 unless the verdict is `mismatch`.")
    reason: str = Field(description="The reason for the verdict, in a sentence.")
    test: Literal["rounding", "blocks", "block", "noise", "variances", "diagnosis"] = Field(
        description="Which test decided."
    )
    margin: float | None = Field(
        description="How far the number that decided is from its limit, as a share of the limit; below 0 for "
        "a mismatch."
    )
    samples_factor: float | None = Field(
        description="How many times as many samples both pictures would need for this difference to count "
        "as real; null if nothing is beyond the tolerance."
    )
    metrics: ComparisonMetrics = Field(description="The numbers.")
    diagnosis: tuple[ComparisonCause, ...] = Field(description="The best explanation first; often none.")
    worst_regions: tuple[ComparisonRegion, ...] = Field(description="At most 5, worst first.")
    inputs: ComparisonInputs = Field(description="How both pictures were read.")
    policy: ComparisonPolicy = Field(description="Tolerance and limits of the request.")
    images: ComparisonPictures | None = Field(
        default=None, description="Pictures of the differences, if they were requested."
    )
