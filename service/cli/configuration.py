"""Settings of a service, from options and the environment, with errors in the words of both."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.errors import CommandError

if TYPE_CHECKING:
    from service.settings import Settings


ConfigOption = Annotated[
    Path | None,
    typer.Option(
        help="A TOML file of settings; by default that named by PENUMBRA_CONFIG.", show_default=False
    ),
]


def read_settings(given: Mapping[str, Any], *, config: Path | None = None) -> Settings:
    """The settings with these options; what is not given comes from the environment, else from a file.

    Parameters
    ----------
    config
        The file, in place of that which ``PENUMBRA_CONFIG`` names.

    Raises
    ------
    CommandError
        They make no sense; the message names each with its variable.
    """
    from pydantic import ValidationError
    from pydantic_settings import SettingsError

    from service.settings import Settings, SettingsFileError

    if config is not None:
        os.environ["PENUMBRA_CONFIG"] = str(config)
    try:
        return Settings.model_validate(given)
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)
        raise CommandError(" ".join(map(_told, found))) from error
    except (SettingsError, SettingsFileError) as error:
        raise CommandError(f"{error}.") from error


def _told(item: Mapping[str, Any]) -> str:
    from service.settings import DEFAULT, source_of

    path = tuple(str(part) for part in item["loc"])
    source = source_of(path)
    variable = "PENUMBRA_" + ("__".join(path).upper() or "...")
    name = variable if source in {DEFAULT, variable} else f"{'.'.join(path)} in {source}"
    unknown = item["type"] in {"extra_forbidden", "unexpected_keyword_argument"}
    sentence = "There is no such setting" if unknown else item["msg"].removeprefix("Value error, ")
    return f"{name}: {sentence}."
