"""NotComparableError   a picture cannot be read as colours, or two pictures cannot be laid on each other."""

from renderer.errors import ImageFileError


class NotComparableError(ImageFileError):
    """Nothing can be said about these pictures; the message says why and what to do."""
