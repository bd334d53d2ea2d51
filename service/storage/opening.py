"""Errors of opening the data folder or the database, in words for the operator."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from service.errors import ServiceError
from service.storage.reserve import RESERVE_BYTES

OPENING_ERRORS = (ServiceError, OSError, SQLAlchemyError)
"""Exceptions of opening them; errors of files are about the data folder."""


def reason(error: Exception, data: Path) -> str:
    """Describe the problem and its cure.

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
        case DBAPIError(orig=sqlite3.OperationalError()) if _is_full(data):
            return f"The database cannot be used: the disk of {data} is full. Make some room on it."
        case SQLAlchemyError():
            return f"The database cannot be used: {str(error).splitlines()[0]}"
        case FileExistsError():
            return f"The data folder {data} cannot be used: it is a file. Name another."
        case NotADirectoryError():
            return f"The data folder {data} cannot be used: it is below a file. Name another."
        case OSError():
            return f"The data folder {data} cannot be used: {error.strerror}. Name another."
    return str(error)


def _is_full(data: Path) -> bool:
    return data.exists() and shutil.disk_usage(data).free < RESERVE_BYTES
