"""A file of another kind is recognised by its content and called by its name."""

import gzip
import io
import json
import zipfile
from typing import Any

import numpy as np
import pytest
from PIL import Image

from renderer.images import files as image_files
from schemas.api.jobs import JobRequest
from schemas.errors import SceneError
from schemas.reading import read_document, read_scene
from service.client.parcels import pack


def picture(kind: str) -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", (3, 2)).save(buffer, format=kind)
    return buffer.getvalue()


def archive() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("scene.json", "{}")
    return buffer.getvalue()


PIXELS = np.zeros((2, 3, 3), np.float32)
OTHERS: dict[str, tuple[bytes, str]] = {
    "png": (picture("PNG"), "This is a PNG picture, not a scene. A scene names its pictures: give one as"),
    "jpeg": (picture("JPEG"), "This is a JPEG picture, not a scene."),
    "gif": (picture("GIF"), "This is a GIF picture, not a scene."),
    "webp": (picture("WEBP"), "This is a WebP picture, not a scene."),
    "tiff": (picture("TIFF"), "This is a TIFF picture, not a scene."),
    "exr": (b"\x76\x2f\x31\x01\x02\x00\x00\x00", "This is an OpenEXR picture, not a scene."),
    "hdr": (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n", "This is a Radiance picture (HDR), not a scene."),
    "pfm": (b"PF\n3 2\n-1.0\n", "This is a PFM picture, not a scene."),
    "npy": (image_files.encode_npy(PIXELS), "This is a NumPy array (.npy), not a scene. Give the JSON file"),
    "zip": (archive(), "This is a ZIP archive, not a scene. Unpack it"),
    "gzip": (gzip.compress(b"{}"), "This is a gzip archive, not a scene. Unpack it"),
    "pdf": (b"%PDF-1.7\n%\xe2\xe3", "This is a PDF document, not a scene."),
    "obj": (
        b"# made by hand\nv 0 0 0\nv 1 0 0\n",
        "This is an OBJ mesh, not a scene. A scene names its meshes",
    ),
    "ply": (b"ply\nformat ascii 1.0\n", "This is a PLY mesh, not a scene."),
    "glb": (b"glTF\x02\x00\x00\x00", "This is a binary glTF mesh (GLB), not a scene."),
    "page": (
        b"\n<!DOCTYPE html>\n<html>",
        "This is a web page (HTML), not a scene. Download the file itself",
    ),
}


@pytest.mark.parametrize(("content", "start"), OTHERS.values(), ids=OTHERS)
def test_file_given_as_a_scene(content: bytes, start: str) -> None:
    for read in (read_scene, pack):
        with pytest.raises(SceneError) as caught:
            read(content)
        (problem,) = caught.value.errors
        assert problem.code == "wrong_file"
        assert problem.detail.startswith(start)
        assert problem.line is None


def test_file_posted_as_a_request() -> None:
    with pytest.raises(SceneError) as caught:
        read_document(picture("PNG"), JobRequest)
    assert caught.value.errors[0].detail.startswith("This is a PNG picture, not a JSON document.")


JSON_OTHERS: dict[str, tuple[dict[str, Any], str]] = {
    "glTF": ({"asset": {"version": "2.0"}, "nodes": []}, "This is a glTF file, not a scene."),
    "CS171": ({"spp": 4, "cam_config": {}}, "This is a CS171 scene. Make a scene of it with"),
    "request": ({"scene": {"version": 1}}, "This is a job request, not a scene. Give what stands in"),
}


@pytest.mark.parametrize(("document", "start"), JSON_OTHERS.values(), ids=JSON_OTHERS)
def test_json_of_another_kind(document: dict[str, Any], start: str) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(json.dumps(document))
    (problem,) = caught.value.errors
    assert (problem.pointer, problem.code) == ("", "wrong_file")
    assert problem.detail.startswith(start)
