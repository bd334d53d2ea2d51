"""The manifest of an assignment: its tests, with points, submitted files and references."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, ConfigDict, Field, field_validator
from pydantic_core import PydanticCustomError

from schemas.api.comparisons import Encoding
from schemas.base import Closed, chosen_by, tag
from schemas.grading.acceptance import Acceptance, CpuSeconds, RayShare, Verdict
from schemas.grading.grades import Feedback
from schemas.quality import Quality
from schemas.quantities import WHOLE, Count, Index, Name, Point, Size

MANIFEST = "penumbra/manifest/v1"

MOST_TESTS = 200
"""Tests of a manifest: one process each."""


def _inside(name: str) -> str:
    parts = name.split("/")
    if "\\" in name or ":" in name or name.startswith("/") or ".." in parts or "" in parts:
        raise PydanticCustomError(
            "outside",
            "This must be the name of a file inside its folder, such as pictures/soft.png: relative, with "
            "forward slashes, without '..'.",
        )
    return name


def _word(name: str) -> str:
    if not name[0].isalnum() or not all(c.isascii() and (c.isalnum() or c in "-_") for c in name):
        raise PydanticCustomError(
            "not_an_id",
            "An id consists of letters, digits, '-' and '_' and begins with a letter or digit: files are "
            "named after it.",
        )
    return name


def _moment(text: str) -> str:
    try:
        aware = datetime.fromisoformat(text).tzinfo is not None
    except ValueError:
        aware = False
    if not aware:
        raise PydanticCustomError(
            "not_a_moment", "Write a time with its zone, ISO 8601, such as 2026-11-21T23:59:00+01:00."
        )
    return text


File = Annotated[str, Field(strict=True, min_length=1, max_length=1024), AfterValidator(_inside)]
"""A file in the folder of the submission or of the manifest, never outside of it."""

Id = Annotated[str, Field(strict=True, min_length=1, max_length=64), AfterValidator(_word)]
Points = Annotated[float, Field(strict=True, ge=0, le=1e6, allow_inf_nan=False)]
Seconds = Annotated[float, Field(strict=True, gt=0, le=86400)]
Moment = Annotated[str, Field(strict=True, max_length=64), AfterValidator(_moment)]
DayShare = Annotated[float, Field(strict=True, gt=0, le=1)]
Minutes = Annotated[float, Field(strict=True, ge=0, le=525600)]
Mebibytes = Annotated[int, Field(strict=True, ge=256, le=1 << 20), WHOLE]
Region = tuple[Index, Index, Index, Index]


class PictureFile(Closed):
    """A picture of the submission."""

    file: File = Field(description="PNG, NPY or EXR, in the folder of the submission.")
    encoding: Encoding = Field(description="How its numbers encode light; never guessed.")


class SceneFile(Closed):
    """A scene of the submission; files that it names must lie beside or below it."""

    type: Literal["scene"] = Field(default="scene", description="`scene`.")
    file: File = Field(description="A scene, in the folder of the submission.")
    quality: Quality | None = Field(
        default=None, description="How it is rendered; by default as the manifest's `quality` says."
    )


class HitsFile(Closed):
    """Hits of the rays, as the submission's own program found them."""

    type: Literal["hits"] = Field(description="`hits`.")
    file: File = Field(description="Arrays as `penumbra trace` writes them, .npz, one row for each ray.")


class ReferencePicture(Closed):
    """A picture beside the manifest."""

    type: Literal["picture"] = Field(description="`picture`.")
    file: File = Field(
        description="PNG, NPY or EXR, in the folder of the manifest, or NPZ with the arrays `image`, `error` "
        "and `samples`. Layers that `penumbra render` saved beside it are used."
    )
    encoding: Encoding = Field(description="How its numbers encode light; never guessed.")
    scene: File | None = Field(
        default=None, description="The scene that it shows: messages then name its shapes."
    )


class ReferenceScene(Closed):
    """A scene beside the manifest, rendered once for all tests that share it."""

    type: Literal["scene"] = Field(description="`scene`.")
    file: File = Field(description="A scene, in the folder of the manifest.")
    quality: Quality | None = Field(
        default=None, description="How it is rendered; by default as the manifest's `quality` says."
    )


class RaysFile(Closed):
    """Rays from a file."""

    type: Literal["file"] = Field(description="`file`.")
    file: File = Field(
        description="Arrays `origins` and `directions`, (N, 3), .npz, in the folder of the manifest."
    )


class CameraRays(Closed):
    """Rays through the centres of a grid over the picture of the reference scene, row by row."""

    type: Literal["camera"] = Field(description="`camera`.")
    width: Count = Field(default=32, description="Columns of the grid.")
    height: Count = Field(default=32, description="Rows of the grid.")


class BallRays(Closed):
    """Random rays from a sphere towards points of a ball at its centre."""

    type: Literal["ball"] = Field(description="`ball`.")
    center: Point = Field(description="Centre of both, scene units.")
    distance: Size = Field(description="Radius of the sphere on which the rays start, scene units.")
    radius: Size = Field(description="Radius of the ball at which they are aimed, scene units.")
    count: Annotated[int, Field(strict=True, ge=1, le=1_000_000), WHOLE] = Field(
        default=1000, description="Number of rays, 1 to 1,000,000."
    )
    seed: Index = Field(default=0, description="Chooses the rays.")


Reference = Annotated[
    Annotated[ReferencePicture, tag(ReferencePicture)] | Annotated[ReferenceScene, tag(ReferenceScene)],
    chosen_by({"picture": (ReferencePicture,), "scene": (ReferenceScene,)}),
]
Rays = Annotated[
    Annotated[RaysFile, tag(RaysFile)]
    | Annotated[CameraRays, tag(CameraRays)]
    | Annotated[BallRays, tag(BallRays)],
    chosen_by({"file": (RaysFile,), "camera": (CameraRays,), "ball": (BallRays,)}),
]
TracedBy = Annotated[
    Annotated[HitsFile, tag(HitsFile)] | Annotated[SceneFile, tag(SceneFile)],
    chosen_by({"hits": (HitsFile,), "scene": (SceneFile,)}),
]
RayField = Literal["t", "position", "normal", "uv", "shape", "visibility"]


class Criterion(Closed):
    """The fields of every test."""

    id: Id = Field(description="A unique id for programs; files are named after it.")
    name: Name = Field(description="The name that people read.")
    points: Points = Field(description="Points for full marks.")
    bonus: bool = Field(
        default=False, strict=True, description="Whether its points are added on top of the full score."
    )
    hidden: bool = Field(default=False, strict=True, description="Whether it is hidden from students.")
    feedback: Feedback | None = Field(
        default=None, description="What students see of it; by default as the manifest says."
    )
    requires: tuple[Id, ...] | None = Field(
        default=None,
        description="Ids of tests listed before: without all points in them this one earns none. By default "
        "a test of the kind `time` requires those of the kind `scene` that submit the same file.",
    )
    tags: tuple[Name, ...] = Field(default=(), description="Words to sort tests by.")
    advice: Annotated[str, Field(strict=True, max_length=2000)] | None = Field(
        default=None, description="What a student who lost points reads after the reason."
    )
    deadline: Seconds | None = Field(
        default=None, description="Seconds after which it is stopped; by default as the manifest says."
    )
    memory: Mebibytes | None = Field(
        default=None, description="The most MiB that it may use; by default as the manifest says."
    )


class _Seen(Criterion):
    region: Region | None = Field(
        default=None,
        description="Only these pixels count: [x0, y0, x1, y1], without x1 and y1, rows from the top.",
    )
    mask: File | None = Field(
        default=None,
        description="Only pixels that are not black in this picture, in the folder of the manifest, count.",
    )
    accept: Acceptance = Field(
        default_factory=lambda: Verdict(by="verdict"),
        description="What earns how many points; by default `by: verdict`.",
    )

    @field_validator("region")
    @classmethod
    def _have_pixels(cls, region: Region | None) -> Region | None:
        if region is not None and not (region[0] < region[2] and region[1] < region[3]):
            raise PydanticCustomError(
                "empty_region", "This region has no pixels: x0 must be less than x1, and y0 less than y1."
            )
        return region


class ImageTest(_Seen):
    """Compares a submitted picture with a reference."""

    kind: Literal["image"]
    submitted: PictureFile = Field(description="The picture.")
    reference: Reference = Field(description="What it should look like.")


class SceneTest(_Seen):
    """Renders a submitted scene and compares it with a reference."""

    kind: Literal["scene"]
    submitted: SceneFile = Field(description="The scene.")
    reference: Reference = Field(description="What its picture should look like.")


class RaysTest(Criterion):
    """Compares what rays hit, by the submission and in the reference scene."""

    kind: Literal["rays"]
    submitted: TracedBy = Field(description="Hits in a file, or a scene that the grader traces.")
    reference: File = Field(description="A scene, in the folder of the manifest.")
    rays: Rays = Field(
        default_factory=lambda: CameraRays(type="camera"),
        description="The rays; by default those of the camera.",
    )
    fields: Annotated[tuple[RayField, ...], Field(min_length=1)] = Field(
        default=("t", "position", "normal", "shape"), description="Which arrays must agree."
    )
    precision: Literal["single", "double"] = Field(
        default="single",
        description="Arithmetic of the submission's program: tolerances are derived from its rounding.",
    )
    tolerance: Annotated[float, Field(strict=True, gt=0, le=1)] | None = Field(
        default=None,
        description="Relative tolerance of distances and directions, instead of the one that follows from "
        "`precision`.",
    )
    accept: RayShare = Field(
        default_factory=RayShare, description="What share of rays that agree earns how many points."
    )


class TimeTest(Criterion):
    """Compares the CPU seconds of a render with a budget. The grader measures them itself."""

    kind: Literal["time"]
    submitted: SceneFile = Field(description="A scene that the grader renders.")
    accept: CpuSeconds = Field(description="What CPU seconds earn how many points.")


Test = Annotated[
    Annotated[ImageTest, tag(ImageTest)]
    | Annotated[SceneTest, tag(SceneTest)]
    | Annotated[RaysTest, tag(RaysTest)]
    | Annotated[TimeTest, tag(TimeTest)],
    chosen_by(
        {"image": (ImageTest,), "scene": (SceneTest,), "rays": (RaysTest,), "time": (TimeTest,)}, field="kind"
    ),
]


ProgramMistake = Literal[
    "encoding", "orientation", "channels", "offset", "exposure", "ambient", "antialiasing"
]


class Charge(Closed):
    """Mistakes that a program makes in all its pictures, and the tests that they cost points in.

    They are looked for in the pictures of all tests of the kind `image` together. Where one is found, the
    tests listed here judge it, and all others judge their pictures as if it were fixed.
    """

    mistakes: Annotated[tuple[ProgramMistake, ...], Field(min_length=1)] = Field(
        description="Kinds of mistakes, as in the table below."
    )
    tests: Annotated[tuple[Id, ...], Field(min_length=1)] = Field(
        description="Ids of the tests, of the kind `image`, that judge them."
    )


class LatePolicy(Closed):
    """Points lost by a late submission: a share of the full score for each day begun after the deadline."""

    deadline: Moment = Field(description="ISO 8601, with its time zone.")
    per_day: DayShare = Field(description="Share of the full score that each day begun costs, 0 to 1.")
    most: DayShare = Field(default=1.0, description="The largest share that lateness costs.")
    grace: Minutes = Field(default=0.0, description="Minutes after the deadline that cost nothing.")


class PerStudent(Closed):
    """Scenes that differ from student to student, so that nobody can hand in the picture of another.

    The name or number of a student decides how the camera stands and what colours materials have.
    """

    scenes: Annotated[tuple[File, ...], Field(min_length=1)] = Field(
        description="References of `type: scene` that differ."
    )
    secret: Annotated[str, Field(strict=True, min_length=8, max_length=1024)] = Field(
        description="Words that only staff know, at least 8 characters; other ones give other scenes."
    )
    turn: Annotated[float, Field(strict=True, ge=0, le=180)] = Field(
        description="The camera turns about `up` through `look_at` by up to so many degrees, either way."
    )
    colors: Annotated[float, Field(strict=True, ge=0, le=1)] = Field(
        description="Each channel of a material's `color` changes by up to so much. It stays between 0 and "
        "the largest channel."
    )


class Manifest(Closed):
    """An assignment. Submitted files are relative to the submission, references to the manifest."""

    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True, serialize_by_alias=True)

    schema_: Literal["penumbra/manifest/v1"] = Field(alias="schema", description=f"`{MANIFEST}`.")
    title: Name = Field(description="The title that people read.")
    quality: Quality | None = Field(
        default=None, description="How scenes are rendered; by default with their own `sampling`."
    )
    deadline: Seconds = Field(
        default=60.0, description="Seconds after which a test, or rendering a reference, is stopped."
    )
    memory: Mebibytes | None = Field(
        default=None, description="The most MiB that a test may use, not counting the program itself."
    )
    feedback: Feedback = Field(
        default="difference",
        description="What students see of a test: its points alone (`none`); whether it is passed "
        "(`verdict`); why it is not, with a map of the `difference`; or the `picture` beside its reference. "
        "Who sees references can hand in copies of them.",
    )
    late: LatePolicy | None = Field(default=None, description="What lateness costs; by default nothing.")
    per_student: PerStudent | None = Field(
        default=None, description="How scenes differ from student to student; by default they do not."
    )
    charged_once: tuple[Charge, ...] = Field(
        default=(),
        description="Mistakes of a whole program, which cost points only in some tests.",
    )
    tests: Annotated[tuple[Test, ...], Field(min_length=1, max_length=MOST_TESTS)] = Field(
        description="The tests, in the order of the report."
    )

    def required(self, test: Criterion) -> tuple[str, ...]:
        """Ids of the tests without which a test earns nothing."""
        if test.requires is not None or not isinstance(test, TimeTest):
            return test.requires or ()
        scenes = (other for other in self.tests if isinstance(other, SceneTest))
        return tuple(other.id for other in scenes if other.submitted.file == test.submitted.file)
