"""The files in deploy: their commands, settings and names exist, by the tools that read them."""

import os
import re
import shlex
import shutil
import subprocess
import sys
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

ROOT = Path(__file__).parents[2]

DEPLOY = ROOT / "deploy"
UNITS = sorted((DEPLOY / "systemd").glob("*.service"))
DASK: dict[str, Command] = {"worker": dask_worker.main, "scheduler": dask_scheduler.main}


def text_of(path: Path) -> str:
    return path.read_text().replace("\\\n", " ")


def commands() -> Iterator[tuple[str, list[str]]]:
    """Every command line that starts one of the programs, with the file that it is in."""
    for path in [*UNITS, DEPLOY / "slurm" / "workers.sbatch"]:
        for found in re.findall(
            r"^(?!#).*?(?:/bin/|\b)((?:dask|penumbra) [a-z]+ ?.*)$", text_of(path), re.MULTILINE
        ):
            yield path.name, shlex.split(found)
    for name, container in containers():
        yield name, container["command"]


def containers() -> Iterator[tuple[str, dict[str, Any]]]:
    yield from compose()["services"].items()
    for document in kubernetes("Deployment"):
        pod = document["spec"]["template"]["spec"]
        for container in (*pod.get("initContainers", ()), *pod["containers"]):
            yield document["metadata"]["name"], container


def compose() -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load((DEPLOY / "compose" / "compose.yaml").read_text())
    return document


def kubernetes(kind: str) -> list[dict[str, Any]]:
    documents = yaml.safe_load_all((DEPLOY / "kubernetes" / "penumbra.yaml").read_text())
    return [document for document in documents if document["kind"] == kind]


COMMANDS = list(commands())


def test_deployments_start_a_server_a_scheduler_and_workers() -> None:
    started = [(where, " ".join(line[:2])) for where, line in COMMANDS]
    assert [what for where, what in started if where == "workers.sbatch"] == ["dask worker"]
    others = sorted(what for where, what in started if where != "workers.sbatch")
    first_key, others = ["penumbra keys"], [what for what in others if what != "penumbra keys"]
    assert [what for _, what in started if what == "penumbra keys"] == first_key
    assert others == ["dask scheduler"] * 3 + ["dask worker"] * 3 + ["penumbra serve"] * 3


@pytest.mark.parametrize(
    ("where", "line"), COMMANDS, ids=lambda part: part if isinstance(part, str) else part[1]
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
    names = set(re.findall(r"PENUMBRA_(\w+)", "".join(path.read_text() for path in DEPLOY.rglob("*.*"))))
    assert names - {"CONFIG"} <= {name.upper() for name in Settings.model_fields}
    assert "DASK_TLS_KEY" in names


def test_cluster_settings_are_settings_of_dask() -> None:
    written = dict(flat(yaml.safe_load((DEPLOY / "dask.yaml").read_text())))
    unknown = [name for name in written if dask.config.get(name, default=unknown_name) is unknown_name]
    assert unknown == []
    assert {name: written[name] for name in LOCAL} == LOCAL


unknown_name = object()


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
    verify = ["systemd-analyze", "verify", "--man=no", str(there)]
    answer = subprocess.run(
        verify, capture_output=True, text=True, check=False, env=os.environ | {"LANG": "C"}
    )
    assert answer.stderr == ""
    assert answer.returncode == 0


def test_compose_declares_networks_and_volumes() -> None:
    document = compose()
    declared = {*document["networks"], *document["volumes"], "default"}
    for service in document["services"].values():
        volumes = {volume.partition(":")[0] for volume in service.get("volumes", ())}
        files = {name for name in volumes if name.startswith(".")}
        assert {*service["networks"]} | volumes - files <= declared
        assert all((DEPLOY / "compose" / name).is_file() for name in files)


def test_kubernetes_volumes_and_services_match() -> None:
    workloads = [*kubernetes("Deployment"), *kubernetes("StatefulSet")]
    pods = {document["metadata"]["name"]: document["spec"]["template"] for document in workloads}
    for document in workloads:
        pod = document["spec"]["template"]["spec"]
        running = (*pod.get("initContainers", ()), *pod["containers"])
        mounted = {mount["name"] for container in running for mount in container["volumeMounts"]}
        claimed = [claim["metadata"] for claim in document["spec"].get("volumeClaimTemplates", ())]
        assert mounted == {volume["name"] for volume in (*pod.get("volumes", ()), *claimed)}
    for document in kubernetes("Service"):
        pod = pods[document["spec"]["selector"]["app"]]
        assert pod["metadata"]["labels"] == document["spec"]["selector"]
        ports = pod["spec"]["containers"][0]["ports"]
        assert [port["containerPort"] for port in ports] == [
            port["port"] for port in document["spec"]["ports"]
        ]


def test_kubernetes_manifests_satisfy_the_schema() -> None:
    documents = [*yaml.safe_load_all((DEPLOY / "kubernetes" / "penumbra.yaml").read_text())]
    newest = kubernetes_validate.latest_version()
    for document in documents:
        # Strict: a field that is misspelt is none.
        kubernetes_validate.validate(document, newest, strict=True)


def test_shell_scripts_parse() -> None:
    for path in (DEPLOY / "certificates.sh", DEPLOY / "slurm" / "workers.sbatch"):
        subprocess.run(["bash", "-n", str(path)], check=True)
