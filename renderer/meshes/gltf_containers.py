"""The containers of glTF 2.0: the two chunks of a GLB, and URIs of buffers that lie elsewhere.

Source: Khronos Group, glTF 2.0 specification, sections 3.6.1 (buffers) and 4.4 (binary glTF layout).
"""

import base64
import binascii
import re
import struct
from urllib.parse import unquote

from renderer.assets import AssetError

DAMAGED = "The mesh cannot be read as glTF: it is damaged. Save it again."
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<II")
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")


def split_glb(content: bytes) -> tuple[bytes, bytes | None]:
    """The JSON text of a GLB, and the bytes after it, or None if it has none.

    Raises
    ------
    AssetError
        If it is not a GLB of version 2, or a chunk ends beyond the file.
    """
    try:
        magic, version, _ = _HEADER.unpack_from(content)
        text, end = _chunk(content, _HEADER.size, _JSON)
        if (magic, version) != (b"glTF", 2):
            raise AssetError(DAMAGED)
        return text, (_chunk(content, end, _BINARY)[0] if end < len(content) else None)
    except struct.error as error:
        raise AssetError(DAMAGED) from error


def _chunk(content: bytes, start: int, kind: int) -> tuple[bytes, int]:
    length, found = _CHUNK.unpack_from(content, start)
    end = start + _CHUNK.size + length
    if found != kind or end > len(content):
        raise AssetError(DAMAGED)
    return content[start + _CHUNK.size : end], end


def join_glb(text: bytes, binary: bytes) -> bytes:
    """A GLB of a JSON text and the bytes of its only buffer; both are padded as the format wants."""
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = _CHUNK.pack(len(text), _JSON) + text + _CHUNK.pack(len(binary), _BINARY) + binary
    return _HEADER.pack(b"glTF", 2, _HEADER.size + len(chunks)) + chunks


def is_embedded(uri: str) -> bool:
    """Whether the URI itself holds the bytes."""
    return uri.startswith("data:")


def embedded(uri: str) -> bytes:
    """Bytes of a data URI.

    Raises
    ------
    AssetError
        If they are not written in base64.
    """
    head, _, data = uri.partition(",")
    try:
        if not head.endswith(";base64"):
            raise binascii.Error
        return base64.b64decode(unquote(data), validate=True)
    except (binascii.Error, ValueError) as error:
        raise AssetError("A data URI of the mesh is not base64. Save it again, or as GLB.") from error


def file_name(uri: str) -> str:
    """Name of the file that a relative URI stands for, seen from the file that has the URI.

    Raises
    ------
    AssetError
        If it is an address or an absolute path: nothing is fetched, and nothing elsewhere is opened.

    Examples
    --------
    >>> file_name("two%20words.bin")
    'two words.bin'
    """
    # Some programs on Windows write backslashes, which no URI has.
    name = unquote(uri).replace("\\", "/")
    if _SCHEME.match(uri) or name.startswith("/"):
        raise AssetError(
            "The mesh names a file by an address or an absolute path. Put the file beside it and name it "
            "relative to it, or save the mesh as GLB."
        )
    return name
