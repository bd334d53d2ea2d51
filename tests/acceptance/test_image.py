"""The steps of the Dockerfile, without Docker: its files, its commands, one job, and a clean stop."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import time
from collections.abc import Iterator
from fnmatch import fnmatch
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

import httpx2
import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]

TIMEOUT = 60.0
INSTALLED = "/opt/penumbra"
Instruction = tuple[str, str]


def instructions() -> list[list[Instruction]]:
    """Instructions of the Dockerfile, stage by stage."""
    text = re.sub(r"^#.*\n", "", (ROOT / "Dockerfile").read_text(), flags=re.MULTILINE)
    lines = [line.split(maxsplit=1) for line in text.replace("\\\n", " ").splitlines() if line.strip()]
    stages: list[list[Instruction]] = []
    for name, rest in lines:
        if name == "FROM":
            stages.append([])
        stages[-1].append((name, rest))
    return stages


BUILD, IMAGE = instructions()


def only(stage: list[Instruction], name: str) -> str:
    (rest,) = (rest for found, rest in stage if found == name)
    return rest


def variables() -> dict[str, str]:
    return dict(part.split("=", 1) for part in shlex.split(only(IMAGE, "ENV")))


def sent() -> Iterator[Path]:
    """Files that an engine would send to a build: of the rules of .dockerignore the last that fits counts."""
    rules = (ROOT / ".dockerignore").read_text().split("\n")
    rules = [rule for rule in rules if rule and not rule.startswith("#")]
    # Only folders that a rule lets in can hold files that are sent.
    tops = [ROOT / rule[1:] for rule in rules if rule.startswith("!")]
    assert rules[0] == "*"
    for top in tops:
        for path in [top, *top.rglob("*")]:
            name = path.relative_to(ROOT)
            if path.is_file() and not _ignored(name, rules):
                yield name


def _ignored(name: Path, rules: list[str]) -> bool:
    ignored = False
    for rule in rules:
        pattern = rule.removeprefix("!").removeprefix("**/")
        parts = [*name.parts] if rule.startswith("**/") else [name.parts[0]]
        if any(fnmatch(part, pattern) for part in parts):
            ignored = not rule.startswith("!")
    return ignored


def test_build_context_is_the_package() -> None:
    files = list(sent())
    alone = {str(file) for file in files if len(file.parts) == 1}
    assert alone == {"pyproject.toml", "constraints.txt", "README.md", "LICENSE"}
    assert {file.parts[0] for file in files} - alone == {
        "schemas",
        "renderer",
        "accuracy",
        "service",
        "scenes",
    }
    assert not [file for file in files if "__pycache__" in file.parts or file.suffix == ".pyc"]


def test_image_runs_as_a_user_and_checks_its_health() -> None:
    user = only(IMAGE, "USER")
    assert int(user) > 0
    (made,) = (rest for name, rest in IMAGE if name == "RUN")
    assert f"--uid {user} " in made
    pods = yaml.safe_load_all((ROOT / "deploy" / "kubernetes" / "penumbra.yaml").read_text())
    contexts = [
        pod["spec"]["template"]["spec"]["securityContext"] for pod in pods if pod["kind"] == "Deployment"
    ]
    assert {context["runAsUser"] for context in contexts} == {int(user)}
    assert json.loads(only(IMAGE, "CMD"))[:2] == ["penumbra", "serve"]
    assert probe()[0] == "python"
    assert not {name for name, _ in (*BUILD, *IMAGE)} & {"ADD", "MAINTAINER", "SHELL"}


def probe() -> list[str]:
    """The command of the health check."""
    command: list[str] = json.loads(only(IMAGE, "HEALTHCHECK").partition("CMD")[2])
    return command


def test_image_packages_are_pinned() -> None:
    pinned = {
        canonicalize_name(line.partition("==")[0])
        for line in (ROOT / "constraints.txt").read_text().splitlines()
    }
    (extras,) = re.findall(r"'\.\[([a-z0-9,]+)\]'", only(BUILD, "RUN"))
    needed: set[str] = set()
    _collect("penumbra-render", {"", *extras.split(",")}, needed)
    assert {"numpy", "opentelemetry-sdk"} <= needed
    assert needed <= pinned


def _collect(package: str, extras: set[str], needed: set[str]) -> None:
    """Collect the requirements of a package and of its requirements; packages not installed add none."""
    try:
        requirements = requires(package) or []
    except PackageNotFoundError:
        return
    for requirement in map(Requirement, requirements):
        marker = requirement.marker
        name = str(canonicalize_name(requirement.name))
        asked = marker is None or any(marker.evaluate({"extra": extra}) for extra in extras)
        if asked and name not in needed:
            needed.add(name)
            _collect(name, {"", *requirement.extras}, needed)


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """The package, installed from what is sent to a build, as the build installs it.

    What it needs is there already, in the versions of constraints.txt; nothing is fetched.
    """
    for file in sent():
        there = tmp_path / "source" / file
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / file, there)
    (made, installing) = only(BUILD, "RUN").split("&&")
    assert shlex.split(made) == ["python", "-m", "venv", INSTALLED]
    pip, *words = shlex.split(installing)
    assert pip == f"{INSTALLED}/bin/pip"
    target = tmp_path / "opt"
    here = ["--quiet", "--no-deps", "--no-build-isolation", "--target", str(target)]
    subprocess.run([sys.executable, "-m", "pip", *words, *here], cwd=tmp_path / "source", check=True)
    return target


@pytest.mark.slow
def test_image_commands_render_a_job_and_stop(installed: Path, tmp_path: Path) -> None:
    data = tmp_path / "data"
    port = _free_port()
    environment = {
        "PATH": f"{installed / 'bin'}:{sysconfig.get_path('scripts')}:{os.environ['PATH']}",
        "PYTHONPATH": str(installed),
        "PYTHONUNBUFFERED": variables()["PYTHONUNBUFFERED"],
        "PENUMBRA_DATA": str(data),
        # As compose.yaml has it.
        **yaml.safe_load((ROOT / "compose.yaml").read_text())["services"]["penumbra"]["environment"],
    }
    command = [
        {"0.0.0.0": "127.0.0.1", "8000": str(port)}.get(word, word)  # noqa: S104  (loopback takes its place)
        for word in json.loads(only(IMAGE, "CMD"))
    ]
    with subprocess.Popen(command, cwd=tmp_path, env=environment) as service:
        try:
            _wait_until_healthy(port, environment)
            _render(port)
            assert {where.parent.parent for where in _packages(environment)} == {installed}
            service.send_signal(signal.SIGTERM)
            assert service.wait(TIMEOUT) == 0
        finally:
            service.kill()
    assert (data / "penumbra.sqlite").exists()


def _packages(environment: dict[str, str]) -> list[Path]:
    """Where a Python of the image finds the packages of the project."""
    names = "service, renderer, schemas, scenes"
    program = f"import {names}\nfor module in ({names}): print(module.__file__)"
    command = [sys.executable, "-P", "-c", program]
    printed = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
    return [Path(line) for line in printed.splitlines()]


def _wait_until_healthy(port: int, environment: dict[str, str]) -> None:
    command = [word.replace(":8000/", f":{port}/") for word in probe()]
    deadline = time.monotonic() + TIMEOUT
    while subprocess.run(command, env=environment, stderr=subprocess.DEVNULL, check=False).returncode:
        assert time.monotonic() < deadline, "the service was not healthy in time"
        time.sleep(0.1)


def _render(port: int) -> None:
    scene = json.loads((ROOT / "scenes" / "gallery" / "basic.json").read_text())
    scene["camera"] |= {"width": 24, "height": 24}
    with httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=TIMEOUT) as client:
        job = client.post("/v1/jobs", json={"scene": scene}, headers={"Prefer": "wait=30"}).json()
        assert job["state"] == "succeeded", job
        assert client.get(job["links"]["image_png"]).headers["Content-Type"] == "image/png"


def _free_port() -> int:
    with socket.socket() as probing:
        probing.bind(("127.0.0.1", 0))
        port: int = probing.getsockname()[1]
        return port
