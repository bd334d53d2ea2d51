"""What can go wrong in the service. ``problems.py`` says how each of them is answered.

ServiceError
├── RequestError                a header or a parameter makes no sense
│   ├── BodyTooLargeError
│   ├── BodyIncompleteError
│   ├── MediaTypeError
│   └── RangeError
├── UnknownJobError
├── PictureNotReadyError
├── PictureGoneError
├── UnknownLayerError           the job was not asked for it
├── UnknownAssetError
├── UploadError                 a texture is not kept
│   ├── UploadMismatchError
│   └── UploadUnusableError
├── StoreError
│   ├── StoreFullError          the disk is full
│   ├── StoreDamagedError       a stored file is not what was written
│   └── StoreTakenError         another service uses the data folder
├── TraceFailedError
├── QuoteFailedError
├── ComparisonFailedError
├── InspectionFailedError
└── UnavailableError            try again later
    ├── BusyError               too many do the same
    └── WorkerLostError
"""

from __future__ import annotations


class ServiceError(Exception):
    """Base of all errors of the service. The message is meant for the person who asked."""


class RequestError(ServiceError):
    """A header or a parameter of a request makes no sense."""


class BodyTooLargeError(RequestError):
    """A request body is longer than the service takes."""


class BodyIncompleteError(RequestError):
    """The connection ended before the body did."""


class MediaTypeError(RequestError):
    """A request body is not of a type that the route reads."""


class RangeError(RequestError):
    """None of the bytes asked for exist.

    Parameters
    ----------
    size : int
        How many bytes there are.
    """

    def __init__(self, size: int) -> None:
        super().__init__(f"There are only {size} bytes.")
        self.size = size


class UnknownJobError(ServiceError):
    """No job has this id."""

    def __init__(self) -> None:
        super().__init__("There is no job with this id. It may have been deleted.")


class PictureNotReadyError(ServiceError):
    """A job has not shown anything yet."""


class PictureGoneError(ServiceError):
    """A job ended without a picture."""


class UnknownLayerError(ServiceError):
    """A job was not asked for this layer."""


class UnknownAssetError(ServiceError):
    """No texture was uploaded under this name."""

    def __init__(self) -> None:
        super().__init__("No asset was uploaded under this name.")


class UploadError(ServiceError):
    """A texture sent is not kept."""


class UploadMismatchError(UploadError):
    """The bytes sent do not have the hash in the address."""


class UploadUnusableError(UploadError):
    """The bytes sent are not a picture that the renderer can use."""


class StoreError(ServiceError):
    """Base of what can be wrong with the data folder."""


class StoreFullError(StoreError):
    """The disk is full."""


class StoreDamagedError(StoreError):
    """A stored file is not what was written."""


class StoreTakenError(StoreError):
    """Another service uses the same data folder."""


class TraceFailedError(ServiceError):
    """Rays could not be traced."""


class QuoteFailedError(ServiceError):
    """A scene could not be quoted."""


class ComparisonFailedError(ServiceError):
    """Two pictures could not be compared."""


class InspectionFailedError(ServiceError):
    """The renderer failed on the pixel of an inspection."""


class UnavailableError(ServiceError):
    """The service cannot do this now and may be able to do it later."""


class BusyError(UnavailableError):
    """Too many ask for the same at once."""


class WorkerLostError(UnavailableError):
    """A worker process died while it answered."""
