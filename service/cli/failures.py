"""The table from exceptions to exit codes, and how each is reported to people and programs."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from typing import Any

from typer.exceptions import TyperException

from renderer.errors import ImageFileError, MissingExtraError, RenderError
from schemas.errors import Problem, SceneError
from schemas.limits import LimitsError
from service.cli import output
from service.cli.errors import (
    CommandError,
    ExitCode,
    InputError,
    RefusedOptionsError,
    ServiceStartError,
    UnusableSceneError,
)
from service.cli.extras import SERVER, has_server, installation
from service.cli.output import excerpts
from service.cli.wording import plain
from service.client.errors import (
    ClientError,
    NoImageError,
    NotAllowedError,
    RefusedError,
    RequestInvalidError,
    TimedOutError,
)
from service.grading.errors import ExportError

OUTCOMES: tuple[tuple[type[BaseException], ExitCode, str], ...] = (
    (TyperException, ExitCode.USAGE, "Wrong usage"),
    (InputError, ExitCode.UNUSABLE_INPUT, "The input cannot be used"),
    (ServiceStartError, ExitCode.SERVER, "The service did not run"),
    (CommandError, ExitCode.USAGE, "Wrong usage"),
    (LimitsError, ExitCode.USAGE, "A limit cannot be used"),
    (MissingExtraError, ExitCode.USAGE, "An optional package is missing"),
    (ImageFileError, ExitCode.UNUSABLE_INPUT, "The picture cannot be used"),
    (RenderError, ExitCode.INTERNAL, "Rendering failed"),
    (ExportError, ExitCode.USAGE, "The result has no such form here"),
    (SceneError, ExitCode.UNUSABLE_INPUT, "The scene cannot be used"),
    (RequestInvalidError, ExitCode.UNUSABLE_INPUT, "The service refused the request"),
    (TimedOutError, ExitCode.TIME_OUT, "Timeout"),
    (NoImageError, ExitCode.SERVER, "There is no picture"),
    (ClientError, ExitCode.SERVER, "Server or network"),
)
"""The first row that fits counts."""

UNKNOWN = "A bug in Penumbra itself"
UNAUTHENTICATED = 401
"""Status of requests without a valid key."""


def report(error: BaseException, *, as_json: bool) -> ExitCode:
    """Report what went wrong, as words on stderr or as a problem document on stdout.

    Returns
    -------
    ExitCode
        The code to leave with.
    """
    if isinstance(error, ModuleNotFoundError) and not has_server():
        error = CommandError(f"A service needs more packages. Install them with: {installation(SERVER)}")
    code, title = _outcome(error)
    if title == UNKNOWN:
        traceback.print_exception(error)
    if as_json:
        output.document(_problem_document(error, title, code))
    else:
        for line in _lines(error, title):
            output.say(line)
    return code


def _outcome(error: BaseException) -> tuple[ExitCode, str]:
    for kind, code, title in OUTCOMES:
        if isinstance(error, kind):
            return code, title
    return ExitCode.INTERNAL, UNKNOWN


def _problem_document(error: BaseException, title: str, code: ExitCode) -> dict[str, Any]:
    if isinstance(error, RefusedError):
        return error.document.model_dump(mode="json", exclude_none=True) | {"exit_code": code}
    problems, more = _problems(error)
    about = {"type": "about:blank", "title": title, "detail": _message(error), "exit_code": int(code)}
    job_id = getattr(error, "job_id", None)
    return (
        about
        | ({"job_id": job_id} if job_id else {})
        | {"errors": [problem.model_dump(exclude_none=True) for problem in problems], "more": more}
    )


def _lines(error: BaseException, title: str) -> list[str]:
    problems, more = ((), 0) if isinstance(error, RefusedOptionsError) else _problems(error)
    text = error.text if isinstance(error, UnusableSceneError) else b""
    # Names of files and answers of servers may hold control characters.
    message = "\n".join(map(output.harmless, (_message(error) or title).split("\n")))
    first, *rest = [line for part in f"error: {message}".split("\n") for line in output.folded(part)]
    lines = [output.emphasis("error", "red") + first.removeprefix("error"), *rest]
    lines += excerpts(text, [problem for problem in problems if problem.detail != message], more)
    return [*lines, *(line for advice in _advice(error) for line in output.folded(advice))]


def _advice(error: BaseException) -> list[str]:
    if _outcome(error)[1] == UNKNOWN:
        return ["This is a bug in Penumbra, not in your input. Please report it with the lines above."]
    if isinstance(error, NotAllowedError) and error.status == UNAUTHENTICATED:
        return ["Commands take your key from the variable PENUMBRA_KEY."]
    if isinstance(error, TimedOutError) and error.job_id:
        job_id = error.job_id
        return [f"Wait again with 'penumbra wait {job_id}', or stop it with 'penumbra cancel {job_id}'."]
    usage = getattr(getattr(error, "ctx", None), "command_path", None)
    return [f"Try '{usage} --help'."] if usage else []


def _problems(error: BaseException) -> tuple[Sequence[Problem], int]:
    match error:
        case UnusableSceneError():
            return error.problems, error.more
        case RefusedOptionsError():
            return error.problems, 0
        case SceneError():
            return error.errors, error.more
        case RefusedError():
            return error.errors, error.document.more
        case _:
            return (), 0


def _message(error: BaseException) -> str:
    match error:
        case TyperException():
            return plain(error.format_message())
        case SceneError():
            return "The scene cannot be used."
        case RefusedError():
            return error.document.detail or error.document.title
        case TimedOutError():
            return error.what
        case _:
            return str(error) or type(error).__name__
