"""What every test of a run shares."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from schemas.grading.manifests import Criterion, Manifest, SceneFile
from schemas.quality import Quality
from service.grading.errors import BrokenTestError
from service.grading.folders import Folder
from service.grading.references import Prepared
from service.grading.rendering import Ordered


@dataclass(frozen=True, slots=True)
class Run:
    """What every test of a run shares.

    Attributes
    ----------
    manifest : Manifest
    references, submission : Folder
        Of the manifest, and of what is graded.
    server : str or None
        The service that renders; None for this machine.
    pictures : bool
        Whether pictures of differences are made.
    prepared : mapping
        References that are rendered, by `references.word_of`; where that failed the reason.
    """

    manifest: Manifest
    references: Folder
    submission: Folder
    server: str | None = None
    pictures: bool = False
    prepared: Mapping[str, Prepared | str] = field(default_factory=dict)

    def deadline(self, test: Criterion) -> float:
        """Seconds that a test may take."""
        return self.manifest.deadline if test.deadline is None else test.deadline

    def order(self, folder: Folder, file: str, quality: Quality | None, timeout: float) -> Ordered:
        """A scene to be rendered, by the manifest's quality where it has none of its own."""
        return Ordered(folder, file, quality or self.manifest.quality, self.server, timeout)

    def submitted(self, scene: SceneFile, test: Criterion) -> Ordered:
        """The scene that a test asks the submission for."""
        return self.order(self.submission, scene.file, scene.quality, self.deadline(test))

    def reference(self, word: str) -> Prepared:
        """A reference that was rendered.

        Raises
        ------
        BrokenTestError
            It could not be.
        """
        prepared = self.prepared[word]
        if isinstance(prepared, str):
            raise BrokenTestError(f"The reference was not rendered. {prepared}")
        return prepared
