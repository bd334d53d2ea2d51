"""Write a submission to the assignment, with a mistake on request.

``python -m tests.service.grading.assignment scenes/assignment handed-in --wrong half_pixel_off``
"""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from tests.service.grading.assignment import program
from tests.service.grading.assignment.mistakes import MISTAKES
from tests.service.grading.assignment.programs import PROGRAMS

SWITCHES = sorted({each.name for each in (*MISTAKES, *PROGRAMS)})


def main() -> None:
    """Read the arguments and write all files."""
    given = arguments()
    program.run(given.scenes, given.out, frozenset(given.wrong), given.samples, given.seed)


def arguments() -> Namespace:
    parser = ArgumentParser(prog="python -m tests.service.grading.assignment")
    parser.add_argument("scenes", type=Path, help="folder with the scenes of the assignment")
    parser.add_argument("out", type=Path, help="folder for the pictures and ray tables")
    parser.add_argument("--wrong", action="append", default=[], choices=SWITCHES, help="a mistake to make")
    parser.add_argument("--samples", type=int, default=program.SAMPLES, help="camera samples per pixel")
    parser.add_argument("--seed", type=int, default=0, help="of the random samples")
    given = parser.parse_args()
    if not any(program.names(given.scenes)):
        parser.error(f"{given.scenes} has no scenes (*.json): name the folder scenes/assignment or a copy")
    if given.samples < 1:
        parser.error(f"--samples is {given.samples}; it must be at least 1")
    return given


if __name__ == "__main__":
    main()
