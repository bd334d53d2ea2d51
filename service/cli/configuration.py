"""Settings of a service, from options and the environment, with errors in the words of both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from service.cli.errors import CommandError

if TYPE_CHECKING:
    from service.settings import Settings


def read_settings(given: Mapping[str, Any]) -> Settings:
    """The settings with these options; what is not given comes from the environment.

    Raises
    ------
    CommandError
        They make no sense; the message names each with its variable.
    """
    from pydantic import ValidationError
    from pydantic_settings import SettingsError

    from service.settings import Settings

    try:
        return Settings.model_validate(given)
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)
        raise CommandError(" ".join(f"{_variable(item['loc'])}: {item['msg']}." for item in found)) from error
    except SettingsError as error:
        raise CommandError(f"{error}.") from error


def _variable(location: tuple[int | str, ...]) -> str:
    return "PENUMBRA_" + ("__".join(str(part) for part in location).upper() or "...")
