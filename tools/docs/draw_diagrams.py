"""Draw the diagrams of the explanations, in docs/images/diagrams.

Run it with ``python -m tools.docs.draw_diagrams``. Rays end where they hit: the places are computed.
"""

from __future__ import annotations

from pathlib import Path

from tools.docs.diagrams import crashes, errors, light, structure

FOLDER = Path(__file__).parents[2] / "docs" / "images" / "diagrams"


def diagrams() -> dict[str, str]:
    """Each diagram by the name of its file."""
    return {
        "penumbra.svg": light.penumbra(),
        "epsilon.svg": light.epsilon(),
        "sides.svg": light.sides(),
        "interpolation.svg": errors.interpolation(),
        "probes.svg": errors.probes(),
        "intervals.svg": errors.intervals(),
        "killed-worker.svg": crashes.killed_worker(),
        "task-states.svg": crashes.task_states(),
        "terms.svg": crashes.terms(),
        "job.svg": structure.job(),
        "ray.svg": structure.ray(),
        "states.svg": structure.states(),
    }


def main() -> None:
    """Write all of them."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, text in diagrams().items():
        (FOLDER / name).write_text(text)


if __name__ == "__main__":
    main()
