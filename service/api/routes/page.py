"""Pages for people: the live page with its files, the gallery that it starts from, and the HTTP reference."""

from __future__ import annotations

import gzip
import hashlib
import json
import os
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import fastapi
from fastapi import APIRouter, FastAPI, Request, Response
from starlette.exceptions import HTTPException

import scenes
from service.api.middleware import ALWAYS
from service.api.reference_page import page_of
from service.api.request_headers import check_preconditions, joined

# Not part of the API: these addresses are for people.
router = APIRouter(include_in_schema=False)

SOURCES = Path(__file__).parents[2] / "web"
BUILT = SOURCES.with_name("built_web")
WEB = BUILT if BUILT.is_dir() else SOURCES
"""Files of the page: those of a release are few, built from the sources."""
GALLERY = Path(str(scenes.__file__)).parent / "gallery"
TYPES = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".ply": "application/octet-stream",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".webp": "image/webp",
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = ALWAYS | {"Content-Security-Policy": POLICY}

# Paths below a folder, without `..` and empty parts.
BELOW = re.compile(r"[\w-]+(?:\.[\w-]+)*(?:/[\w-]+(?:\.[\w-]+)*)*", re.ASCII)

VERSIONED = re.compile(r"v-[0-9a-f]{16}/")
ASK_AGAIN, FOR_EVER = "no-cache", "public, max-age=31536000, immutable"

COMPRESSIBLE = ("text/", "application/json", "image/svg+xml")
"""Beginnings of media types whose files become smaller; pictures are compressed already."""
FEWEST_BYTES = 1000
"""Smaller files fit in one packet with or without compression."""
_REFUSED = re.compile(r"q=0(?:\.0*)?")

FilePath = Annotated[str, fastapi.Path(max_length=200)]


@router.get("/")
@router.get("/jobs")
@router.get("/jobs/{job_id}")
@router.get("/service")
@router.get("/compare")
@router.get("/compare/{a}/{b}")
def page(request: Request) -> Response:
    """Serve the page. Its script reads the address, so that links can be shared."""
    return _page(request, _index(), TYPES[".html"])


def missing(request: Request) -> Response | None:
    """Serve the page at an unknown address to a browser, with 404: it says where to go instead."""
    if request.method != "GET" or "text/html" not in joined(request, "accept"):
        return None
    return Response(_index(), 404, HEADERS, TYPES[".html"])


def _index() -> bytes:
    """The page, whose files are at addresses that change with them: browsers never ask for them again.

    Modules import each other by relative paths, so the version in the address of the first is in all.
    """
    html = (WEB / "index.html").read_bytes()
    return html.replace(b'"/web/', f'"/web/{_version()}'.encode())


def _version() -> str:
    return _hash_of(tuple(sorted(_files(str(WEB)))))


def _files(folder: str) -> Iterator[tuple[str, int, int]]:
    """Paths of files, with what changes when they do. For each file of a visit all are looked at."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir():
                yield from _files(entry.path)
            else:
                status = entry.stat()
                yield entry.path, status.st_mtime_ns, status.st_size


@lru_cache(maxsize=1)
def _hash_of(files: tuple[tuple[str, int, int], ...]) -> str:
    hashed = hashlib.sha256()
    for path, _, size in files:
        hashed.update(f"{Path(path).relative_to(WEB)} {size} ".encode() + Path(path).read_bytes())
    return f"v-{hashed.hexdigest()[:16]}/"


@router.get("/web/{path:path}")
def web_file(request: Request, path: FilePath) -> Response:
    """Serve a script, a style sheet or a picture of the page, at its own address or at that of a version.

    A page of an earlier version that is still open gets the newest files, which no cache keeps as its own.
    """
    version = VERSIONED.match(path)
    if version is None:
        return _file(request, WEB, path)
    kept = FOR_EVER if version[0] == _version() else ASK_AGAIN
    return _file(request, WEB, path[version.end() :], kept)


@router.get("/gallery/{path:path}")
def gallery_file(request: Request, path: FilePath) -> Response:
    """Serve a scene of the gallery, or a texture or a mesh of one."""
    return _file(request, GALLERY, path)


@router.get("/docs")
def reference(request: Request) -> Response:
    """Serve the HTTP reference, written from the same document as `/openapi.json`."""
    return _page(request, _reference_of(request.app), TYPES[".html"])


@router.get("/openapi.json")
def openapi_document(request: Request) -> Response:
    """Serve the OpenAPI document."""
    return _page(request, _document_of(request.app), TYPES[".json"])


# An application has one document for its life, which takes seconds to build; the page, some milliseconds.
@lru_cache(maxsize=1)
def _reference_of(app: FastAPI) -> bytes:
    return page_of(app.openapi()).encode()


@lru_cache(maxsize=1)
def _document_of(app: FastAPI) -> bytes:
    return json.dumps(app.openapi(), ensure_ascii=False, separators=(",", ":")).encode()


def _file(request: Request, folder: Path, path: str, kept: str = ASK_AGAIN) -> Response:
    """Serve the newest version of a file."""
    wanted = folder / path
    media_type = TYPES.get(wanted.suffix)
    if media_type is None or not BELOW.fullmatch(path) or not wanted.is_file():
        raise HTTPException(404, "There is no such page.")
    return _page(request, wanted.read_bytes(), media_type, kept)


def _page(request: Request, content: bytes, media_type: str, kept: str = ASK_AGAIN) -> Response:
    """Serve some content, compressed where the browser accepts that, or 304 if the browser has it."""
    tag = hashlib.sha256(content).hexdigest()[:32]
    headers = HEADERS | {"Cache-Control": kept}
    # Answers with secrets are never compressed: their length could betray them.
    if len(content) >= FEWEST_BYTES and media_type.startswith(COMPRESSIBLE):
        headers["Vary"] = "Accept-Encoding"
        if _accepts_gzip(joined(request, "accept-encoding")):
            content, tag = _gzipped(content), f"{tag}-gzip"
            headers["Content-Encoding"] = "gzip"
    headers["ETag"] = f'"{tag}"'
    unchanged = check_preconditions(request, headers)
    if unchanged is None:
        return Response(content, media_type=media_type, headers=headers)
    # Browsers replace the headers that they have stored by those of this answer.
    unchanged.headers.update(headers)
    return unchanged


@lru_cache(maxsize=512)
def _gzipped(content: bytes) -> bytes:
    """Files of the page are compressed once, not for each visitor."""
    return gzip.compress(content, mtime=0)


def _accepts_gzip(header: str) -> bool:
    """Whether an Accept-Encoding header allows gzip (RFC 9110, section 12.5.3).

    >>> [_accepts_gzip(header) for header in ("br, gzip", "*", "GZIP;q=0.5", "", "br", "gzip;q=0, *")]
    [True, True, True, False, False, False]
    """
    found: dict[str, list[str]] = {}
    for part in header.lower().split(","):
        name, *parameters = (piece.strip() for piece in part.split(";"))
        found[name] = parameters
    named = found.get("gzip", found.get("*"))
    return named is not None and not any(map(_REFUSED.fullmatch, named))
