"""The same manifest gives the same points here and with a service that renders."""

from pathlib import Path

import pytest

from service.client import Client
from service.server import RunningServer
from tests.service.grading.assignments import (
    SCENE,
    Assignment,
    image_test,
    pixels,
    rays_test,
    scene,
    scene_test,
    time_test,
)

RANDOM = {"antialiasing": {"pattern": "random", "samples": 16}, "seed": 5}


@pytest.fixture
def assignment(tmp_path: Path) -> Assignment:
    """A submission with a right picture, one without light, and scenes of both."""
    made = Assignment.of(tmp_path)
    made.hand_in("right.npy", pixels(SCENE))
    made.hand_in("dark.npy", pixels(scene(lights=[])))
    made.hand_in("dark.json", scene(lights=[]))
    made.hand_in("noisy.json", scene(sampling=RANDOM))
    made.hand_in("broken.json", scene(shapes=[{"type": "ellipsoid"}]))
    return made


@pytest.mark.slow
def test_scores_of_a_service_are_those_of_this_machine(assignment: Assignment, server: RunningServer) -> None:
    tests = (
        image_test(id="right", submitted={"file": "right.npy", "encoding": "linear"}),
        image_test(
            id="dark",
            submitted={"file": "dark.npy", "encoding": "linear"},
            accept={"by": "metric", "metric": "rmse", "full": 0.01, "zero": 0.9},
        ),
        scene_test(),
        scene_test(id="dark-scene", submitted={"file": "dark.json"}, accept={"by": "verdict", "zero": 1.0}),
        scene_test(id="noisy", submitted={"file": "noisy.json"}),
        scene_test(id="broken", submitted={"file": "broken.json"}),
        rays_test(submitted={"type": "scene", "file": "dark.json"}),
    )
    here, there = assignment.grade(*tests), assignment.grade(*tests, server=server.url)
    for one, other in zip(here.tests, there.tests, strict=True):
        assert (one.points, one.status, one.metrics) == (other.points, other.status, other.metrics)
    assert here.score > 30
    assert 0 < here.tests[1].points < 10


def test_time_of_a_scene_is_what_its_job_has_cost(assignment: Assignment, server: RunningServer) -> None:
    found = assignment.test(time_test(accept={"full": 60}), server=server.url)
    with Client(server.url) as client:
        costs = [job.cost.cpu_seconds for job in client.list(limit=20).jobs]
    assert found.value in costs
    assert found.status == "passed"


@pytest.mark.slow
def test_job_that_is_given_up_is_cancelled(assignment: Assignment, server: RunningServer) -> None:
    large = scene(sampling={"antialiasing": {"pattern": "uniform", "samples": 1024}})
    large["camera"] = SCENE["camera"] | {"width": 960, "height": 640}
    assignment.hand_in("large.json", large | {"name": "given up"})
    outcome = assignment.test(scene_test(submitted={"file": "large.json"}, deadline=4.0), server=server.url)
    assert outcome.status == "error"
    with Client(server.url) as client:
        (job,) = [job for job in client.list(limit=20).jobs if job.name == "given up"]
    assert job.state == "cancelled"
