"""What each effect of a scene costs, measured and shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from service.cli import output

if TYPE_CHECKING:
    from renderer import LoadedScene


def measure(scene: LoadedScene) -> dict[str, Any]:
    """CPU seconds of a small picture, and what each effect adds to it, as one document."""
    from dataclasses import asdict

    from accuracy.quotes.ablation import marginal_costs

    seconds, rows = marginal_costs(scene)
    return {"cpu_seconds": seconds, "effects": [asdict(row) for row in rows]}


def show(measured: dict[str, Any]) -> None:
    """Print the costs: a table on a terminal, a line an effect elsewhere."""
    if not output.on_terminal():
        for row in measured["effects"]:
            values = (
                row["effect"],
                f"{row['seconds']:.4f}",
                f"{row['difference'] * 255:.3f}",
                *row["pointers"],
            )
            output.result("measured\t" + "\t".join(output.harmless(str(value)) for value in values))
        return
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table("Effect", "CPU seconds", "Share", "Difference x 255", "Asked for by", box=box.SIMPLE_HEAD)
    for row in measured["effects"]:
        pointers = "\n".join(output.harmless(pointer) for pointer in row["pointers"][:3])
        numbers = (f"{row['seconds']:.3f}", f"{row['share']:.0%}", f"{row['difference'] * 255:.2f}")
        table.add_row(row["effect"], *numbers, pointers)
    console = Console(markup=False, highlight=False)
    seconds = f"{measured['cpu_seconds']:.3f} CPU seconds"
    console.print(f"Measured on a small picture of {seconds}, each effect left out once:")
    console.print(table)
