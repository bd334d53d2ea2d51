"""``penumbra handout``: the scenes that a student is to render, where they differ from student to student."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.cli.errors import CommandError, InputError
from service.cli.grade import read_manifest_file, read_table
from service.cli.targets import make_folder, save


def handout(
    *,
    manifest: Annotated[
        Path, typer.Argument(metavar="MANIFEST", help="The assignment, .yaml or .json.", show_default=False)
    ],
    out: Annotated[
        Path,
        typer.Option("-o", "--out", metavar="DIR", help="Folder for a folder of scenes for each student."),
    ],
    student: Annotated[
        list[str] | None, typer.Option(help="Name or number of a student, as grade takes it; repeatable.")
    ] = None,
    roster: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="A table with all students, as grade takes it.")
    ] = None,
) -> None:
    """Write the scenes of each student, for an assignment whose scenes differ from student to student."""
    from service.grading.classes.rosters import Roster
    from service.grading.folders import Folder, is_hidden
    from service.grading.variants import scenes_for

    read = read_manifest_file(manifest)
    if read.per_student is None:
        raise CommandError(f"{manifest} has no per_student: all students render the same scenes.")
    table = read_table(roster, Roster.read)
    students = [*(student or ()), *filter(None, table.students if table else ())]
    if not students:
        raise CommandError("No student is given. Name some with --student or --roster.")
    folder = Folder(manifest.parent.resolve(), "reference")
    for name in students:
        if Path(name).name != name or is_hidden(name):
            raise CommandError(f"{name!r} cannot be the name of a folder. Use a name without slashes.")
        found = scenes_for(read.per_student, folder, name)
        for file in read.per_student.scenes:
            if file not in found:
                raise InputError(f"{manifest.parent / file} is not a usable scene. See penumbra validate.")
            make_folder((out / name / file).parent)
            save(out / name / file, found[file])
