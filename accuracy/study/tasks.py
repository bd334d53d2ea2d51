"""What a study has to render: each task a picture, and what it is compared with."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

from accuracy.study.keys import key_of, scene_key

if TYPE_CHECKING:
    from renderer.scenes import LoadedScene
    from schemas.quality import Quality
    from schemas.scene import Scene

Part = Literal["reference", "setting", "precision", "whole", "effect", "size", "picture"]


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """A scene as it is rendered: at the size of the study, whole or without one effect.

    Attributes
    ----------
    scene : LoadedScene
    key : str
        Digest of what it shows.
    effect : str
        What is left out; empty for the whole scene.
    pointers : tuple of str
        Lines of the scene that ask for it.
    """

    scene: LoadedScene
    key: str
    effect: str = ""
    pointers: tuple[str, ...] = ()

    @classmethod
    def of(cls, scene: LoadedScene, effect: str = "", pointers: tuple[str, ...] = ()) -> Subject:
        """Make one of a scene."""
        return cls(scene, scene_key(scene), effect, pointers)

    def seeded(self, seed: int) -> LoadedScene:
        """The scene with other random numbers."""
        document = self.scene.document
        sampling = document.sampling.model_copy(update={"seed": seed})
        return replace(self.scene, document=document.model_copy(update={"sampling": sampling}))


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """One picture to render.

    Attributes
    ----------
    part : str
        What the study needs it for.
    name : str
        What it is called in that part.
    subject : Subject
    quality : Quality
    seed : int
    place : str
        Digest of the machine: elsewhere seconds are other ones.
    judges : tuple of Task
        The halves of the reference; empty where no error is wanted.
    against : Task or None
        Whose picture it is compared with.
    kept : bool
        Whether its picture is kept.
    key : str
        Digest of all this but part and name: what is rendered once is not rendered again.
    """

    part: Part
    name: str
    subject: Subject
    quality: Quality
    seed: int
    place: str
    judges: tuple[Task, ...] = ()
    against: Task | None = None
    kept: bool = False
    key: str = field(init=False)

    def __post_init__(self) -> None:
        key = key_of(
            self.place,
            self.subject.key,
            self.quality.model_dump(mode="json"),
            self.seed,
            [judge.key for judge in self.judges],
            self.against.key if self.against else None,
            self.kept,
        )
        object.__setattr__(self, "key", key)


def sized(document: Scene, side: int) -> Scene:
    """The scene with at most so many pixels along its longer side, its shape kept.

    Examples
    --------
    >>> from schemas.reading import read_scene
    >>> camera = {"position": [0, 0, 1], "look_at": [0, 0, 0], "width": 300, "height": 200}
    >>> small = sized(read_scene({"version": 1, "camera": camera})[0], 150)
    >>> small.camera.width, small.camera.height
    (150, 100)
    """
    camera = document.camera
    scale = min(1.0, side / max(camera.width, camera.height))
    size = {"width": max(1, round(camera.width * scale)), "height": max(1, round(camera.height * scale))}
    return document.model_copy(update={"camera": camera.model_copy(update=size)})
