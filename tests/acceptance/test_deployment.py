"""The image and the files in deploy: their commands and settings exist, by the tools that read them."""

import json
import re
import shlex
import shutil
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import dask.config
import distributed  # noqa: F401  (its settings have defaults once it is imported)
import kubernetes_validate
import pytest
import yaml
from click import Command
from distributed.cli import dask_scheduler, dask_worker
from typer.main import get_group

from service.cli.commands import application
from service.settings import Settings
from service.workers.dask_engine import LOCAL
from tests.service.cli.conftest import ROOT, ended

DEPLOY = ROOT / "deploy"
UNITS = sorted((DEPLOY / "systemd").glob("*.service"))
DASK: dict[str, Command] = {"worker": dask_worker.main, "scheduler": dask_scheduler.main}
COMPOSE: dict[str, Any] = yaml.safe_load((DEPLOY / "compose" / "compose.yaml").read_text())
KUBERNETES: list[dict[str, Any]] = [
    *yaml.safe_load_all((DEPLOY / "kubernetes" / "penumbra.yaml").read_text())
]
IMAGE = (ROOT / "Dockerfile").read_text().replace("\\\n", " ")
WORKLOADS = [each for each in KUBERNETES if each["kind"] in {"Deployment", "StatefulSet"}]


def containers(pod: dict[str, Any]) -> list[dict[str, Any]]:
    return [*pod.get("initContainers", ()), *pod["containers"]]


def commands() -> Iterator[tuple[str, list[str]]]:
    """Every command line that starts one of the programs, with the file that it is in."""
    for path in [*UNITS, DEPLOY / "slurm" / "workers.sbatch"]:
        text = path.read_text().replace("\\\n", " ")
        for found in re.findall(r"^(?!#).*?(?:/bin/|\b)((?:dask|penumbra) [a-z]+ ?.*)$", text, re.MULTILINE):
            yield path.name, shlex.split(found)
    yield "image", json.loads(re.findall(r"^CMD (.*)$", IMAGE, re.MULTILINE)[0])
    for name, service in COMPOSE["services"].items():
        yield name, service["command"]
    for document in WORKLOADS:
        for container in containers(document["spec"]["template"]["spec"]):
            if "command" in container:
                yield document["metadata"]["name"], container["command"]


@pytest.mark.parametrize(
    ("where", "line"), [*commands()], ids=lambda part: part if isinstance(part, str) else part[1]
)
def test_commands_are_understood(where: str, line: list[str], tmp_path: Path) -> None:
    program, name, *arguments = line
    # Files that are named are looked for.
    file = tmp_path / "file.pem"
    file.touch()
    named = [str(file) if part.endswith((".pem", ".key")) else part for part in arguments]
    command = DASK[name] if program == "dask" else get_group(application()).commands[name]
    if hasattr(command, "commands"):
        command, named = command.commands[named[0]], named[1:]
    with command.make_context(name, named) as context:
        assert not context.args or program == "dask"
    if name == "worker":
        assert context.params["nthreads"] == 1


def test_variables_of_containers_are_settings() -> None:
    files = [*DEPLOY.rglob("*.*"), ROOT / "Dockerfile", ROOT / "compose.yaml"]
    names = set(re.findall(r"PENUMBRA_(\w+)", "".join(path.read_text() for path in files)))
    assert names - {"CONFIG"} <= {name.upper() for name in Settings.model_fields}
    assert "DASK_TLS_KEY" in names


def test_cluster_settings_are_settings_of_dask() -> None:
    written = dict(flat(yaml.safe_load((DEPLOY / "dask.yaml").read_text())))
    unknown = object()
    assert [name for name in written if dask.config.get(name, default=unknown) is unknown] == []
    assert {name: written[name] for name in LOCAL} == LOCAL


def flat(document: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in document.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="systemd is not installed")
@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.name)
def test_systemd_units_are_valid(unit: Path, tmp_path: Path) -> None:
    # The programs are where this Python is.
    there = tmp_path / unit.name
    there.write_text(unit.read_text().replace("/opt/penumbra/bin", str(Path(sys.executable).parent)))
    done = ended(tmp_path, there, program=["systemd-analyze", "verify", "--man=no"], LANG="C")
    assert (done.code, done.err) == (0, "")


def test_kubernetes_manifests_satisfy_the_schema_and_match() -> None:
    for document in KUBERNETES:
        # Strict: a field that is misspelt is none.
        kubernetes_validate.validate(document, kubernetes_validate.latest_version(), strict=True)
    pods = {document["metadata"]["name"]: document["spec"]["template"] for document in WORKLOADS}
    for document in WORKLOADS:
        pod = document["spec"]["template"]["spec"]
        mounted = {mount["name"] for container in containers(pod) for mount in container["volumeMounts"]}
        claimed = [claim["metadata"] for claim in document["spec"].get("volumeClaimTemplates", ())]
        assert mounted == {volume["name"] for volume in (*pod.get("volumes", ()), *claimed)}
    for document in KUBERNETES:
        if document["kind"] == "Service":
            pod = pods[document["spec"]["selector"]["app"]]
            assert pod["metadata"]["labels"] == document["spec"]["selector"]
            ports = [port["containerPort"] for port in pod["spec"]["containers"][0]["ports"]]
            assert ports == [port["port"] for port in document["spec"]["ports"]]


@pytest.mark.parametrize("name", ["certificates.sh", "slurm/workers.sbatch"])
def test_shell_script_parses(name: str) -> None:
    assert ended(DEPLOY, name, program=["bash", "-n"]).code == 0


def test_image_is_built_from_the_package_with_its_extras() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    (extras,) = re.findall(r"'\.\[([a-z0-9,]+)\]'", IMAGE)
    assert set(extras.split(",")) <= project["project"]["optional-dependencies"].keys()
    sent = re.findall(r"^!(.*)$", (ROOT / ".dockerignore").read_text(), re.MULTILINE)
    packages = project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    assert sorted(sent) == sorted([*packages, "pyproject.toml", "constraints.txt", "README.md", "LICENSE"])


def test_image_runs_as_the_user_of_kubernetes() -> None:
    (user,) = map(int, re.findall(r"^USER (\d+)$", IMAGE, re.MULTILINE))
    assert user > 0
    assert f"--uid {user} " in IMAGE
    pods = [each["spec"]["template"]["spec"] for each in KUBERNETES if each["kind"] == "Deployment"]
    assert {pod["securityContext"]["runAsUser"] for pod in pods} == {user}


def test_containers_have_no_rights_and_a_version() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    for document in WORKLOADS:
        for container in containers(document["spec"]["template"]["spec"]):
            name, tag = container["image"].split(":")
            assert name == "postgres" or tag == version
            rights = container["securityContext"]
            assert rights["capabilities"] == {"drop": ["ALL"]}
            assert rights["readOnlyRootFilesystem"]
            assert not rights["allowPrivilegeEscalation"]
