"""The names that Python programs import stay where they are."""

import inspect
import subprocess
import sys
from types import ModuleType

import pytest

import renderer
import schemas


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        ("load_scene", ["source"]),
        ("compile_scene", ["scene", "quality"]),
        ("trace", ["plan", "origins", "directions"]),
        ("render", ["plan", "quality", "on_tile", "workers"]),
    ],
)
def test_functions_take_the_promised_arguments(function: str, arguments: list[str]) -> None:
    parameters = inspect.signature(getattr(renderer, function)).parameters
    assert list(parameters)[: len(arguments)] == arguments


def test_scene_error_lists_every_problem() -> None:
    with pytest.raises(renderer.SceneError) as caught:
        renderer.load_scene({"version": 1, "lens": 2})
    assert len(caught.value.errors) > 1


@pytest.mark.parametrize("package", [renderer, schemas], ids=["renderer", "schemas"])
def test_package_has_each_name_it_lists(package: ModuleType) -> None:
    assert sorted(package.__all__) == dir(package)
    assert all(getattr(package, name) is not None for name in package.__all__)
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = package.no_such_name


def test_request_classes_are_names_of_the_schemas() -> None:
    assert schemas.Scene.model_fields.keys() >= {"camera", "shapes"}
    assert schemas.FixedQuality().mode == "fixed"
    assert schemas.TargetQuality(error=0.01).mode == "target"


def test_comparison_loads_no_renderer() -> None:
    """Graders compare in containers with half a processor, where loading a renderer takes longest."""
    probe = "import sys, accuracy.comparison; sys.exit('renderer.plan' in sys.modules)"
    subprocess.run([sys.executable, "-c", probe], check=True)
