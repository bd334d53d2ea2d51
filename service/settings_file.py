"""Settings from a file: TOML, named by ``PENUMBRA_CONFIG``."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource

VARIABLE = "PENUMBRA_CONFIG"
DEFAULT = "default"


class SettingsFileError(Exception):
    """The file that is named cannot be used.

    No ValueError: pydantic would make it an error of some field.
    """


class FileSource(PydanticBaseSettingsSource):
    """What the file says, where one is named.

    Raises
    ------
    SettingsFileError
        It is not there, or is no TOML.
    """

    def __init__(self, settings_cls: type[BaseSettings]) -> None:
        super().__init__(settings_cls)
        self.content = read()

    def get_field_value(self, field: FieldInfo, field_name: str) -> tuple[Any, str, bool]:  # noqa: ARG002  (an interface)
        """Value of one setting; None where the file does not have it."""
        return self.content.get(field_name), field_name, False

    def __call__(self) -> dict[str, Any]:
        """All of it: names that are no settings are refused with the others."""
        return self.content


def read() -> dict[str, Any]:
    """Content of the file that is named; nothing where none is.

    Raises
    ------
    SettingsFileError
        It is not there, or is no TOML.
    """
    name = os.environ.get(VARIABLE)
    if not name:
        return {}
    try:
        return tomllib.loads(Path(name).read_text(encoding="utf-8"))
    except OSError as error:
        raise SettingsFileError(f"The settings file {name} cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsFileError(f"The settings file {name} is no TOML: {error}") from error


def source_of(path: tuple[str, ...]) -> str:
    """From where a setting has its value: a variable, the file, or the default.

    Parameters
    ----------
    path
        Its name, or the name of its group and its own.
    """
    variable = "PENUMBRA_" + "__".join(path).upper()
    if variable in {name.upper() for name in os.environ}:
        return variable
    content: Any = read()
    for name in path:
        if not isinstance(content, dict) or name not in content:
            return DEFAULT
        content = content[name]
    return str(Path(os.environ[VARIABLE]))
