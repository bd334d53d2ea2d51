"""Picture files as textures: light, alpha, parts of files, and the warnings they bring."""

import io
import struct
from typing import Any

import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.images.reading import read_image
from tests.documents import phong, rectangle, scene
from tests.pictures.parts import image_of, plan_of
from tests.renderer.picture_files import deep_png, exr, exr_of_parts, pfm, tiff


def shown(**texture: Any) -> dict[str, Any]:
    return scene(
        rectangle([-3, -3, 0], [6, 0, 0], [0, 6, 0]),
        textures={"a": {"type": "image", "asset": "picture", **texture}},
        materials={"plain": phong(color_texture="a", ambient=1.0, diffuse=0.0)},
        ambient=[1, 1, 1],
    )


def test_texture_may_be_brighter_than_1() -> None:
    bright = np.full((2, 2, 3), 7.5, np.float32)
    for content in (pfm(bright, "<"), exr(dict.fromkeys("RGB", bright[..., 0]))):
        image = image_of(shown(encoding="linear"), files={"picture": content})
        assert image[image.shape[0] // 2, image.shape[1] // 2].tolist() == [7.5] * 3


def test_texture_is_seen_in_a_faint_mirror() -> None:
    """A path ends where nothing that it meets could be seen: a texture of 10^6 times white still is."""
    document = shown(encoding="linear")
    document["materials"] |= {"faint": phong([0, 0, 0], ambient=0.0, diffuse=0.0, mirror=5e-8)}
    document["shapes"] = [
        rectangle([-9, -9, 0], [18, 0, 0], [0, 18, 0], material="faint"),
        rectangle([-99, -99, 20], [198, 0, 0], [0, 198, 0]),
    ]
    image = image_of(document, files={"picture": pfm(np.full((2, 2), 1e6, np.float32), "<")})
    assert image[8, 12].tolist() == pytest.approx([0.05] * 3, rel=1e-6)


@pytest.mark.parametrize(
    ("values", "texture", "said"),
    [([0.5, 0.25], {}, '"encoding": "linear"'), ([0.5, -0.25], {"encoding": "linear"}, "-0.25")],
)
def test_texture_that_is_no_colour_is_a_problem(values: Any, texture: dict[str, Any], said: str) -> None:
    content = pfm(np.array([values], np.float32), "<")
    with pytest.raises(renderer.SceneError) as caught:
        plan_of(shown(**texture), files={"picture": content})
    (problem,) = caught.value.errors
    assert (problem.pointer, problem.code) == ("/textures/a/asset", "asset")
    assert said in problem.detail


def with_alpha(value: int) -> dict[str, bytes]:
    """Pictures whose last pixel has an alpha of `value` / 255."""
    codes = np.full((2, 2, 4), 255, np.uint8)
    codes[1, 1, 3] = value
    deep = codes.astype(np.uint16) * 257
    palette = Image.new("P", (2, 2), 0)
    palette.putpalette([9, 9, 9, 8, 8, 8])
    palette.putpixel((1, 1), 1)
    found = {
        "16 bits": deep_png(deep, 6),
        "16 bits of grey": deep_png(deep[..., 2:], 4),
        "tiff": tiff(deep, ">", 2, extra=2),
        "exr": exr({name: codes[..., i] / np.float32(255) for i, name in enumerate("RGBA")}),
    }
    for picture, options in (
        (Image.fromarray(codes), {}),
        (Image.fromarray(codes).convert("LA"), {}),
        (palette, {"transparency": bytes([255, value])}),
    ):
        buffer = io.BytesIO()
        picture.save(buffer, "PNG", **options)
        found[picture.mode] = buffer.getvalue()
    return found


@pytest.mark.parametrize("kind", with_alpha(0))
def test_alpha_is_warned_of_where_it_is_used(kind: str) -> None:
    for value, count in ((255, 0), (254, 1)):
        plan = plan_of(shown(encoding="linear"), files={"picture": with_alpha(value)[kind]})
        found = [warning for warning in plan.warnings if warning.code == "asset"]
        assert [warning.pointer for warning in found] == ["/textures/a/asset"] * count
        assert all("alpha" in warning.detail for warning in found)


def test_png_transparent_colour_counts_as_alpha() -> None:
    colors = np.random.default_rng(34).integers(0, 1 << 16, (5, 11, 3)).astype(np.uint16)
    for key, count in (((1, 2, 3), 0), (colors[2, 3], 1)):
        assert len(read_image(deep_png(colors, 2, tRNS=struct.pack(">3H", *key))).notes) == count


def test_exr_part_that_is_shown_is_named() -> None:
    planes = dict.fromkeys("RGB", np.full((2, 2), 0.25, np.float32))
    content = exr_of_parts(("depth", {"Z": planes["R"]}), ("beauty", planes))
    plan = plan_of(shown(encoding="linear"), files={"picture": content})
    (warning,) = (warning for warning in plan.warnings if warning.code == "asset")
    assert "'beauty'" in warning.detail


def test_bump_map_of_16_bits_has_no_steps() -> None:
    """A ramp over 512 of 65536 heights is as smooth in colours and with alpha as in grey."""
    ramp = np.tile(np.arange(0, 512, 8, dtype=np.uint16) + 32768, (4, 1))
    document = shown(encoding="linear") | {
        "materials": {"plain": phong(bump_map="a", bump_height=30.0)},
        "lights": [{"type": "directional", "direction": [-1, 0, -1], "color": [1, 1, 1]}],
        "background": [0, 0, 0],
    }
    pictures = [
        image_of(document, files={"picture": content})
        for content in (
            deep_png(ramp[..., None], 0),
            deep_png(np.stack([ramp] * 3, axis=2), 2),
            deep_png(np.stack([ramp, np.full_like(ramp, 65535)], axis=2), 4),
        )
    ]
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures[1:])
    middle = pictures[0][pictures[0].shape[0] // 2, :, 0]
    inside = middle[middle > 0][2:-2]
    assert inside.size > 4
    assert inside.max() - inside.min() < 0.01 * inside.max()
