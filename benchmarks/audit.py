"""Advisories about the dependencies: what `make check` and `make audit` ask for.

    python -m benchmarks.audit            # fails where an advisory is known, or some packages are unknown
    python -m benchmarks.audit --strict   # and where no package could be looked up

Writes `out/audit.json`. Advisories come from the JSON interface of PyPI, which a machine may not reach. Then
nothing is known, and that is said loudly: it is no pass. Where it answers, it has to know every package.
Packages are those of `constraints.txt`.
"""

import argparse
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

CONSTRAINTS = Path("constraints.txt")
OUT = Path("out/audit.json")
TIMEOUT_SECONDS = 120
ACCEPTED: dict[str, str] = {}
"""Advisories that are known and do not concern the project, each with its reason."""

LOUD = "!" * 78


@dataclass(frozen=True)
class Audit:
    """What was found: advisories by package, and the packages that nothing is known about."""

    looked_up: tuple[str, ...]
    unknown: tuple[str, ...]
    advisories: dict[str, list[str]]

    @property
    def complete(self) -> bool:
        """Whether every package was looked up."""
        return bool(self.looked_up) and not self.unknown


def audit(constraints: Path) -> Audit:
    """Ask about all packages of a list of versions; where no answer comes, all of them are unknown."""
    named = [line.partition("==")[0] for line in constraints.read_text().splitlines() if "==" in line[:80]]
    command = [sys.executable, "-m", "pip_audit", "--requirement", str(constraints), "--no-deps"]
    command += ["--disable-pip", "--format", "json", "--progress-spinner", "off", "--timeout", "15"]
    try:
        answer = subprocess.run(
            command, capture_output=True, text=True, timeout=TIMEOUT_SECONDS, check=False
        ).stdout
        packages = json.loads(answer)["dependencies"]
    except (subprocess.TimeoutExpired, json.JSONDecodeError):
        return Audit((), tuple(named), {})
    return read(packages, named)


def read(packages: list[dict[str, Any]], named: list[str]) -> Audit:
    """Read the packages of a report; what it does not list is unknown.

    >>> found = [
    ...     {"name": "a", "version": "1", "vulns": [{"id": "X-1"}]},
    ...     {"name": "b", "skip_reason": "none"},
    ... ]
    >>> read(found, ["a", "b", "c"])
    Audit(looked_up=('a',), unknown=('b', 'c'), advisories={'a': ['X-1']})
    """
    known = {_same(package["name"]): package for package in packages if "vulns" in package}
    advisories = {
        name: ids
        for name in named
        if (ids := [found["id"] for found in known.get(_same(name), {}).get("vulns", ())])
    }
    unknown = tuple(name for name in named if _same(name) not in known)
    return Audit(tuple(name for name in named if name not in unknown), unknown, advisories)


def _same(name: str) -> str:
    return name.lower().replace("_", "-").replace(".", "-")


def open_advisories(found: Audit) -> dict[str, list[str]]:
    """Those that were not accepted."""
    kept = {name: [one for one in ids if one not in ACCEPTED] for name, ids in found.advisories.items()}
    return {name: ids for name, ids in kept.items() if ids}


def report(found: Audit) -> None:
    """Say on stderr what is wrong, and what is not known."""
    for name, ids in open_advisories(found).items():
        sys.stderr.write(
            f"{name}: {', '.join(ids)}. Raise its version in constraints.txt, or enter the advisory in "
            f"{Path(__file__).name} with the reason why it does not concern the project.\n"
        )
    if not found.complete:
        reason = (
            "These versions are not known there: correct constraints.txt."
            if found.looked_up
            else "pypi.org did not answer. This is no pass: run `make audit` where it can be reached."
        )
        shown = ", ".join(found.unknown[:8]) + (" ..." if len(found.unknown) > 8 else "")
        sys.stderr.write(
            f"{LOUD}\nNOT AUDITED: nothing is known of {len(found.unknown)} of "
            f"{len(found.unknown) + len(found.looked_up)} packages ({shown}).\n"
            f"{reason}\n{LOUD}\n"
        )


def main() -> int:
    """Audit, report, and keep what was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--strict", action="store_true", help="fail where a package could not be looked up")
    strict = parser.parse_args().strict or os.environ.get("AUDIT_REQUIRED") == "1"
    found = audit(CONSTRAINTS)
    OUT.parent.mkdir(exist_ok=True)
    document = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "complete": found.complete,
        "looked_up": len(found.looked_up),
        "unknown": list(found.unknown),
        "advisories": found.advisories,
    }
    OUT.write_text(json.dumps(document, indent=2) + "\n")
    report(found)
    if not open_advisories(found) and found.complete:
        sys.stdout.write(f"{len(found.looked_up)} packages audited, no advisory concerns them.\n")
    # Who could ask has no excuse for what is not known.
    excused = found.complete or (not found.looked_up and not strict)
    return 1 if open_advisories(found) or not excused else 0


if __name__ == "__main__":
    sys.exit(main())
