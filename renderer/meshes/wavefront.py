"""Statements of Wavefront files, OBJ and MTL: lines without comments, and the names in them."""

import re
from collections.abc import Iterator

# Some programs write 1.#QNAN for NaN, which must not be read as 1.
_COMMENT = re.compile(rb"#(?!(?<=\.#)[A-Z])")
_MARK = b"\xef\xbb\xbf"
# What follows these is a name, and a '#' may be part of it.
_NAMING = re.compile(rb"\s*(?:usemtl|mtllib|newmtl|g|o|map_\w+|bump|norm|disp|decal|refl)\s", re.IGNORECASE)


def statements(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Line numbers from 1 and text of the statements of an OBJ or MTL file, without comments.

    A backslash at the end of a line joins it to the next, unless it ends a comment.
    """
    begun, first = b"", 0
    for number, line in enumerate(content.removeprefix(_MARK).splitlines(), 1):
        text, start = line, number
        if begun or b"\\" in line or b"#" in line:
            start = first if begun else number
            text, goes_on = _without_comment(begun, line)
            if goes_on:
                begun, first = text + b" ", start
                continue
            begun = b""
        if text and not text.isspace():
            yield start, text
    if begun and not begun.isspace():
        yield first, begun


def _without_comment(begun: bytes, line: bytes) -> tuple[bytes, bool]:
    """A statement up to the end of this line, and whether it goes on in the next."""
    text = line.rstrip()
    comment = _COMMENT.search(text)
    if comment:
        return begun + (text if _NAMING.match(begun + text) else text[: comment.start()]), False
    return (begun + text[:-1], True) if text.endswith(b"\\") else (begun + text, False)


def name_in(text: bytes) -> str:
    """The name after a statement's keyword, empty if there is none.

    It is UTF-8 or else Latin-1, in which every byte is a character: different names stay different.
    """
    name = text.strip().partition(text.split(None, 1)[0])[2].strip()
    try:
        return name.decode()
    except UnicodeDecodeError:
        return name.decode("latin-1")
