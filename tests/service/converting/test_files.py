from pathlib import Path

import pytest

from service.converting.errors import ConversionError, FileAwayError
from service.converting.files import InputFiles, SceneFiles
from tests.service.converting.conftest import TRIANGLE, Convert, noted
from tests.service.converting.test_obj import picture


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """A folder beside a file that must not be read."""
    (tmp_path / "secret.obj").write_bytes(TRIANGLE)
    folder = tmp_path / "input"
    folder.mkdir()
    (folder / "link.obj").symlink_to(tmp_path / "secret.obj")
    return folder


@pytest.mark.parametrize("name", ["../secret.obj", "link.obj", "..\\secret.obj", "/etc/hostname"])
def test_file_outside_the_root(outside: Path, name: str) -> None:
    with pytest.raises(FileAwayError, match="lies outside"):
        InputFiles(outside).read(outside, name)


def test_offered_root_works(outside: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(outside)
    with pytest.raises(FileAwayError, match=r"--root \.\.,"):
        InputFiles(Path()).read(Path(), "../secret.obj")
    assert InputFiles(Path("..")).read(Path(), "../secret.obj")[1] == TRIANGLE


@pytest.mark.parametrize("name", ["gone.obj", "x" * 5000, "a\0b", "."])
def test_missing_file(outside: Path, name: str) -> None:
    with pytest.raises(FileAwayError, match="There is no file"):
        InputFiles(outside).read(outside, name)


def test_file_outside_is_copied(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    inside, away = tmp_path / "out" / "a.obj", tmp_path / "b.obj"
    files = SceneFiles(tmp_path / "out")
    assert files.keep(inside, b"1") == "a.obj"
    assert files.keep(away, b"2") == "b.obj"
    assert files.written == {"b.obj": b"2"}


def test_no_file_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_bytes(b"old")
    files = SceneFiles(tmp_path)
    assert files.make("a", ".obj", b"old") == "a.obj"
    assert files.make("a", ".obj", b"new") == "a-2.obj"
    assert files.make("a", ".obj", b"new") == "a-2.obj"
    assert files.make("a", ".obj", b"newer") == "a-3.obj"


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.json", b'{"version": 1, "camera": {}}', "a scene already"),
        ("a.json", b'{"scene": 1}', "CS171 scene"),
        ("a.json", b"[1]", "JSON object"),
        ("a.fbx", b"Kaydara FBX Binary", "'.fbx' are not known"),
        ("a.json", b'{"cam_config": 1, "cam_config": 2}', "more than once"),
        ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "no triangles"),
        ("a.glb", b"glTF", "damaged"),
    ],
)
def test_unknown_format(converted: Convert, name: str, content: bytes, said: str) -> None:
    with pytest.raises(ConversionError) as caught:
        converted(name, content)
    assert said in caught.value.problems[0].detail


def test_ply_mesh(converted: Convert) -> None:
    content = (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    scene = converted("a.ply", content).document
    assert [(shape["asset"], shape["material"]) for shape in scene["shapes"]] == [("input/a.ply", "grey")]


def test_texture_of_a_ply_comment(converted: Convert) -> None:
    def content(coordinates: bool, *pictures: str) -> bytes:
        lines = ["ply", "format ascii 1.0", *(f"comment TextureFile {name}" for name in pictures)]
        lines += [
            "element vertex 3",
            *(f"property float {name}" for name in "xyzst"[: 5 if coordinates else 3]),
        ]
        lines += ["element face 1", "property list uchar int vertex_indices", "end_header"]
        places = ["0 0 0 0 0", "1 0 0 1 0", "0 1 0 0 1"]
        lines += [place[: 9 if coordinates else 5] for place in places]
        return "\n".join([*lines, "3 0 1 2"]).encode()

    made = converted("a.ply", content(True, "the red.png", "b.png"), **{"the red.png": picture()})
    (material,), (texture,) = made.document["materials"].values(), made.document["textures"].values()
    assert (texture["asset"], texture["encoding"]) == ("input/the red.png", "srgb")
    assert material["color_texture"] in made.document["textures"]
    assert noted(made, "left_out").keys() == {"TextureFile b.png"}
    for input_, word in (
        (content(True, "gone.png"), "no file"),
        (content(False, "the red.png"), "coordinates"),
    ):
        grey = converted("a.ply", input_)
        assert "textures" not in grey.document
        (note,) = noted(grey, "left_out").values()
        assert word in note
