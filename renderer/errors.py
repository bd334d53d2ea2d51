"""The exceptions of rendering.

SceneError (schemas)   a scene, or a file it names, cannot be used
RenderError            a scene that was accepted could not be rendered
  ImageFileError       a picture could not be written or read
    MissingExtraError  for want of a package that is not installed
"""

from schemas.errors import SceneError

__all__ = ["ImageFileError", "MissingExtraError", "RenderError", "SceneError"]


class RenderError(RuntimeError):
    """A scene that was accepted could not be rendered; the message says where and how to repeat it."""


class ImageFileError(RenderError):
    """A picture could not be written or read."""


class MissingExtraError(ImageFileError):
    """A package is not installed that files of this kind need; the message says how to install it."""
