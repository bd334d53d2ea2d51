"""Words that readers would stumble over, and what to write instead: `python tools/check_words.py`."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIST = ROOT / "tools" / "words.toml"
READ = {".py", ".md", ".txt", ".toml", ".yaml", ".yml", ".cff", ".js", ".html", ".css"}
# What others have written, and the list itself.
LEFT_OUT = re.compile(r"vendor/|^constraints\.txt$|^tools/words\.toml$|^docs/figures/|test_words\.py$")


def found(words: dict[str, str], text: str) -> list[tuple[int, str, str]]:
    """Find line, word and what to write instead."""
    pattern = re.compile(
        "|".join(f"(?P<w{number}>\\b(?:{word})\\b)" for number, word in enumerate(words)), re.IGNORECASE
    )
    instead = list(words.values())
    return [
        (number, match.group(), instead[int(str(match.lastgroup)[1:])])
        for number, line in enumerate(text.splitlines(), 1)
        for match in pattern.finditer(line)
    ]


def main() -> None:
    """Print every place; the status is 1 if there is one."""
    words = tomllib.loads(LIST.read_text())
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    places = [
        f"{name}:{line}: {word!r}: {instead}"
        for name in listed.splitlines()
        if Path(name).suffix in READ and not LEFT_OUT.search(name) and (ROOT / name).is_file()
        for line, word, instead in found(words, (ROOT / name).read_text())
    ]
    sys.stdout.writelines(f"{place}\n" for place in places)
    sys.exit(bool(places))


if __name__ == "__main__":
    main()
