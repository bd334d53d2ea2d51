"""Why the data folder or the database of a service cannot be opened, for the person who starts it."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy.exc import SQLAlchemyError

from service.errors import ServiceError

OPENING_ERRORS = (ServiceError, OSError, SQLAlchemyError)
"""What opening them raises; errors of files are about the data folder."""


def reason(error: Exception, data: Path) -> str:
    """Say what is wrong, and what to do.

    Parameters
    ----------
    error : Exception
        One of `OPENING_ERRORS`.
    data : Path
        The data folder.

    Examples
    --------
    >>> reason(FileExistsError(17, "File exists"), Path("lab"))
    'The data folder lab cannot be used: it is a file. Name another.'
    """
    match error:
        case SQLAlchemyError():
            return f"The database cannot be used: {str(error).splitlines()[0]}"
        case FileExistsError():
            return f"The data folder {data} cannot be used: it is a file. Name another."
        case NotADirectoryError():
            return f"The data folder {data} cannot be used: it is below a file. Name another."
        case OSError():
            return f"The data folder {data} cannot be used: {error.strerror}. Name another."
    return str(error)
