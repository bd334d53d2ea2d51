"""Random scenes: few shapes in a small space, with many equal numbers, so that planes and edges coincide."""

from typing import Any

from hypothesis import strategies as st

from schemas.errors import SceneError
from schemas.reading import read_scene
from tests.documents import Json, camera, phong, sampled
from tests.pictures.placed_scenes import placed

Draw = Any

numbers = st.one_of(st.integers(-2, 2).map(float), st.floats(-2, 2, width=32))
vectors = st.tuples(numbers, numbers, numbers).map(list)
colors = st.tuples(*[st.floats(0.1, 1)] * 3).map(list)
materials = st.sampled_from(["matt", "glossy", "sharp"])

MATERIALS = {
    "matt": phong([0.8, 0.7, 0.6]),
    "glossy": phong([0.3, 0.5, 0.7], specular=0.6, shininess=12),
    "sharp": phong([0.4, 0.5, 0.3], specular=0.6, shininess=900),
}


def flat(**more: Any) -> st.SearchStrategy[Json]:
    edges = st.tuples(vectors, vectors).map(list)
    return st.fixed_dictionaries({"type": st.just("rectangle"), "corner": vectors, "edges": edges, **more})


shapes = st.one_of(
    flat(material=materials),
    st.fixed_dictionaries(
        {
            "type": st.just("triangle"),
            "vertices": st.tuples(vectors, vectors, vectors).map(list),
            "material": materials,
        },
        optional={"normals": st.tuples(vectors, vectors, vectors).map(list)},
    ),
    st.fixed_dictionaries(
        {
            "type": st.just("ellipsoid"),
            "center": vectors,
            "radius": st.sampled_from([0.3, 0.5, 1.0, 2.0]),
            "material": materials,
        }
    ),
)
lights = st.one_of(
    flat(color=colors, visible=st.booleans(), two_sided=st.booleans()),
    st.fixed_dictionaries({"type": st.just("point"), "position": vectors, "color": colors}),
    st.fixed_dictionaries({"type": st.just("directional"), "direction": vectors, "color": colors}),
)


@st.composite
def scenes(draw: Draw) -> Json:
    """Scenes that the language accepts, moved and scaled as a whole."""
    samples = draw(st.sampled_from([1, 4]))
    pattern = draw(st.sampled_from(["uniform", "random"]))
    light = draw(st.sampled_from(["uniform", "random", "stratified", "sobol"]))
    document: Json = {
        "version": 1,
        "camera": camera(position=[0.3, 1, draw(st.sampled_from([0.7, 6.1]))], width=18, height=13),
        "ambient": [1, 1, 1],
        "materials": MATERIALS,
        "shapes": draw(st.lists(shapes, min_size=1, max_size=6)),
        "lights": draw(st.lists(lights, min_size=1, max_size=2)),
        "sampling": sampled(samples, draw(st.sampled_from([1, 9])), pattern, light),
    }
    scale = draw(st.sampled_from([1.0, 1.0, 1e-12, 2.0**-20, 3e5, 1e9]))
    offset = draw(st.sampled_from([0.0, 0.0, 10.0, 1e3, 2.0**20]))
    return placed(document, scale, offset)


def accepted(document: Json) -> bool:
    """Whether the language accepts a scene; edges may turn out parallel, vectors zero."""
    try:
        read_scene(document)
    except SceneError:
        return False
    return True
