"""Materials of glTF files, their textures and pictures."""

import numpy as np

from schemas.reading import read_scene
from service.converting.gltf_materials import highlight
from tests.service.converting.conftest import Convert, noted
from tests.service.converting.test_gltf import Made
from tests.service.converting.test_obj import picture


def test_materials_and_textures(converted: Convert) -> None:
    made = Made()
    made.document |= {
        "images": [{"bufferView": made.view(picture()), "mimeType": "image/png", "name": "red"}],
        "samplers": [{"wrapS": 33071, "wrapT": 33071, "magFilter": 9728}],
        "textures": [{"source": 0, "sampler": 0}, {"source": 0}],
        "materials": [
            {
                "name": "paint",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.5, 0.5, 0.5, 1],
                    "baseColorTexture": {"index": 0},
                    "metallicFactor": 0,
                },
                "normalTexture": {"index": 1},
                "doubleSided": True,
            }
        ],
    }
    made.node(mesh=made.mesh(material=0))
    conversion = converted("m.glb", made.glb())
    textures, material = conversion.document["textures"], conversion.document["materials"]["paint"]
    assert conversion.files["red.png"] == picture()
    assert textures[material["color_texture"]] == {
        "type": "image",
        "asset": "red.png",
        "encoding": "srgb",
        "wrap": "clamp",
        "filter": "nearest",
    }
    assert textures[material["normal_map"]]["encoding"] == "linear"
    assert (material["diffuse"], material["specular"], material["shininess"]) == (0.5, 0.04, 0)
    assert noted(conversion, "left_out") == {}
    read_scene(conversion.document)


def test_different_textures_stay_apart(converted: Convert) -> None:
    made = Made()
    samplers = [{"wrapS": 33071, "wrapT": 33071}, {"magFilter": 9728}, {"magFilter": 9729}]
    # All names but the first have to give way, the last because it is too long.
    names = ["a", "a-2", "a", None, "default", "x" * 300]
    color = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": number}}} for number in range(3)]
    others = [{"normalTexture": {"index": 0}}, {"normalTexture": {"index": 1}}, color[0]]
    made.document |= {
        "images": [{"bufferView": made.view(picture()), "mimeType": "image/png", "name": "red"}],
        "samplers": samplers,
        "textures": [{"source": 0, "sampler": number} for number in range(3)],
        "materials": [
            content | ({"name": name} if name else {})
            for name, content in zip(names, [*color, *others], strict=True)
        ],
    }
    for number in range(len(names)):
        made.node(mesh=made.mesh(material=number), translation=[number, 0, 0])
    made.node(mesh=made.mesh(), translation=[9, 0, 0])
    scene = converted("m.glb", made.glb()).document
    used = [scene["materials"][shape["material"]] for shape in scene["shapes"]]
    named = [each.get("color_texture", each.get("normal_map")) for each in used]
    found = [scene["textures"][name] for name in named[:-1]]
    assert [(each["encoding"], each["wrap"], each.get("filter")) for each in found] == [
        ("srgb", "clamp", None),
        ("srgb", "repeat", "nearest"),
        ("srgb", "repeat", None),
        ("linear", "clamp", None),
        ("linear", "repeat", "nearest"),
        ("srgb", "clamp", None),
    ]
    assert len({shape["material"] for shape in scene["shapes"]}) == len(scene["materials"]) == 7
    assert len({shape["asset"] for shape in scene["shapes"]}) == 7
    assert len(scene["textures"]) == 5


def test_roughness_sets_the_highlight() -> None:
    lobes = [highlight(roughness) for roughness in np.linspace(0.1, 1, 10)]
    sharpness = [lobe["shininess"] for lobe in lobes]
    assert sharpness == sorted(sharpness, reverse=True)
    # Between two exponents the share of light that is given back stays: strength / (n + 2) is the same.
    kept = {round(lobe["specular"] / (lobe["shininess"] + 2), 12) for lobe in lobes if lobe["specular"] < 1}
    assert kept == {0.02}
    assert highlight(0)["shininess"] == highlight(0.1)["shininess"]


def test_missing_counterparts_are_noted(converted: Convert) -> None:
    made = Made()
    made.document["materials"] = [
        {
            "alphaMode": "BLEND",
            "emissiveFactor": [1, 1, 1],
            "extensions": {
                "KHR_materials_transmission": {"transmissionFactor": 0.75},
                "KHR_materials_ior": {"ior": 1.33},
                "KHR_materials_clearcoat": {"clearcoatFactor": 1},
            },
        }
    ]
    made.document["animations"] = []
    made.node(mesh=made.mesh(material=0))
    conversion = converted("m.glb", made.glb())
    (material,) = conversion.document["materials"].values()
    assert (material["transmission"], material["ior"], material["diffuse"]) == (0.75, 1.33, 0.25)
    assert set(noted(conversion, "left_out")) == {
        "/animations",
        "/materials/0/alphaMode",
        "/materials/0/emissiveFactor",
        "/materials/0/extensions/KHR_materials_clearcoat",
    }
    assert "Metal" in noted(conversion, "assumed")["/materials/0/pbrMetallicRoughness"]


def test_unreadable_texture_is_noted(converted: Convert) -> None:
    made = Made()
    made.document |= {
        "images": [{"uri": "gone.png"}, {"bufferView": made.view(b"no picture")}],
        "textures": [{"source": 0}, {"source": 1}],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": {"index": 1}}
        ],
    }
    made.node(mesh=made.mesh(material=0))
    conversion = converted("m.glb", made.glb())
    (material,) = conversion.document["materials"].values()
    assert material["color"] == [1, 1, 1]
    assert "normal_map" not in material
    assert noted(conversion, "left_out").keys() == {"/images/0", "/images/1"}
