"""Settings shared by all tests of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from schemas.grading.manifests import Criterion, Manifest, SceneFile
from schemas.quality import Quality
from service.grading.errors import BrokenTestError
from service.grading.folders import Folder
from service.grading.programs.program import NONE, ProgramMistakes
from service.grading.rendering import Ordered


@dataclass(frozen=True, slots=True)
class Run:
    """Settings shared by all tests of a run.

    Attributes
    ----------
    server : str or None
        The service that renders; None for this machine.
    pictures : bool
        Whether to make pictures of the differences.
    keep : Path or None
        A folder of altered pictures that submissions of a class share.
    prepared : mapping
        Files of rendered references by `references.key_of`, or the reason why rendering failed.
    mistakes : ProgramMistakes
        What the submission's program does wrong in all its pictures.
    """

    manifest: Manifest
    references: Folder
    submission: Folder
    server: str | None = None
    pictures: bool = False
    keep: Path | None = None
    prepared: Mapping[str, Path | str] = field(default_factory=dict)
    mistakes: ProgramMistakes = NONE

    def deadline(self, test: Criterion) -> float:
        """Time limit of a test in seconds."""
        return self.manifest.deadline if test.deadline is None else test.deadline

    def order(self, folder: Folder, file: str, quality: Quality | None, timeout: float) -> Ordered:
        """A scene to render; the manifest's quality is the default."""
        return Ordered(folder, file, quality or self.manifest.quality, self.server, timeout)

    def submitted(self, scene: SceneFile, test: Criterion) -> Ordered:
        """The scene that the submission must provide for a test."""
        return self.order(self.submission, scene.file, scene.quality, self.deadline(test))

    def reference(self, key: str) -> Path:
        """The file of a rendered reference.

        Raises
        ------
        BrokenTestError
            It could not be rendered.
        """
        prepared = self.prepared[key]
        if isinstance(prepared, str):
            raise BrokenTestError(f"The reference was not rendered. {prepared}")
        return prepared
