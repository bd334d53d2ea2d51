"""The command lines of the files for operators, with their variables, as real processes on this machine."""

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx2
import pytest
import yaml

from service.server import is_ready
from tests.postgres_server import PostgresServer
from tests.service.support import TIMEOUT, finish, scene, submit, until
from tests.service.workers.test_cluster_security import make_certificates

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PROGRAMS = {"penumbra": "service.cli.main", "dask": "dask"}
LINKS = {"PENUMBRA_PORT": "tcp://10.96.0.17:8000", "PENUMBRA_SERVICE_HOST": "10.96.0.17"}
"""Variables that Kubernetes sets in every pod for the Service named penumbra, unless the pod says
otherwise."""
OF_THE_DATABASE = "what the operator has put into it"


class Place:
    """This machine in place of the containers': other ports, and other folders.

    Parameters
    ----------
    replaced
        What stands in command lines and variables, and what to write for it here.
    """

    def __init__(self, data: Path, replaced: Mapping[str, str]) -> None:
        self.data, self._replaced = data, replaced
        self.url = f"http://127.0.0.1:{port()}"

    def line(self, words: list[str]) -> list[str]:
        program, *rest = map(self._here, words)
        return [sys.executable, "-m", PROGRAMS[program], *rest]

    def environment(self, variables: Mapping[str, str]) -> dict[str, str]:
        given = {name: self._here(value) for name, value in variables.items()}
        # As the image does, of whose commands this is none.
        return os.environ | {"PENUMBRA_DATA": str(self.data), "PENUMBRA_WORKERS": "1"} | given

    def _here(self, text: str) -> str:
        for there, here in self._replaced.items():
            text = text.replace(there, here)
        return text

    @contextmanager
    def running(self, line: list[str], variables: Mapping[str, str]) -> Iterator[None]:
        process = subprocess.Popen(self.line(line), env=self.environment(variables))
        try:
            yield
        finally:
            process.terminate()
            try:
                process.wait(TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def server(self, line: list[str]) -> list[str]:
        return [*line, "--port", self.url.rpartition(":")[2]]


def port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        number: int = probe.getsockname()[1]
        return number


def pods() -> dict[str, dict[str, Any]]:
    documents = yaml.safe_load_all((ROOT / "deploy" / "kubernetes" / "penumbra.yaml").read_text())
    return {
        document["metadata"]["name"]: document["spec"]["template"]["spec"]
        for document in documents
        if document["kind"] == "Deployment"
    }


def variables(pod: dict[str, Any], container: dict[str, Any]) -> dict[str, str]:
    """The environment of a container, as Kubernetes puts it together."""
    found = dict(LINKS) if pod.get("enableServiceLinks", True) else {}
    for one in container.get("env", ()):
        value = one.get("value", OF_THE_DATABASE)
        for name, before in found.items():
            value = value.replace(f"$({name})", before)
        found[one["name"]] = value
    return found


@pytest.mark.skipif(not shutil.which("openssl"), reason="openssl is not installed")
def test_kubernetes_manifest_starts_a_service(postgres: PostgresServer, tmp_path: Path) -> None:
    place = Place(
        tmp_path / "data",
        {
            f"postgresql://penumbra:{OF_THE_DATABASE}@database/penumbra": postgres.database(),
            "/etc/cluster": str(make_certificates(tmp_path / "certificates")),
            "/etc/dask": str(ROOT / "deploy"),
            "/run/first-key": str(tmp_path / "first-key"),
            "scheduler:8786": (scheduler := f"127.0.0.1:{port()}"),
            "8786": scheduler.rpartition(":")[2],
        },
    )
    found = pods()
    server = found["penumbra"]
    (first_key,), (container,) = server["initContainers"], server["containers"]
    (tmp_path / "first-key").mkdir()
    made = [printed(place, first_key["command"], variables(server, first_key)) for _ in range(2)]
    key = (tmp_path / "first-key" / "key").read_text().strip()
    assert "pnm_" not in "".join(made)  # which is in the log
    with ExitStack() as stack:
        for name in ("scheduler", "worker"):
            (only,) = found[name]["containers"]
            stack.enter_context(place.running(only["command"], variables(found[name], only)))
        line = place.server(container["command"])
        stack.enter_context(place.running(line, variables(server, container)))
        assert_renders(place.url, {"Authorization": f"Bearer {key}"})
        assert httpx2.get(f"{place.url}/v1/jobs", timeout=TIMEOUT).status_code == 401


def printed(place: Place, line: list[str], environment: Mapping[str, str]) -> str:
    made = subprocess.run(
        place.line(line),
        env=place.environment(environment),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=True,
        timeout=TIMEOUT,
    )
    return made.stdout


def assert_renders(url: str, headers: Mapping[str, str]) -> None:
    with httpx2.Client(base_url=url, headers=headers, timeout=TIMEOUT) as client:
        until(lambda: is_ready(client), TIMEOUT)
        assert finish(client, submit(client, scene(16, 16)))["progress"]["share"] == 1


@pytest.mark.parametrize("file", ["compose.yaml", "deploy/compose/compose.yaml"])
def test_compose_file_starts_a_service_under_its_own_names(tmp_path: Path, file: str) -> None:
    place = Place(
        tmp_path / "data",
        {
            "/etc/penumbra": str(ROOT / "deploy"),
            "scheduler:8786": (scheduler := f"127.0.0.1:{port()}"),
            "8786": scheduler.rpartition(":")[2],
        },
    )
    services = yaml.safe_load((ROOT / file).read_text())["services"]
    server = services.pop("penumbra")
    # The first runs the command of the image.
    line = server.get("command", ["penumbra", "serve", "--host", "0.0.0.0"])  # noqa: S104  (that of a container)
    with ExitStack() as stack:
        for service in services.values():
            stack.enter_context(place.running(service["command"], service["environment"]))
        stack.enter_context(place.running(place.server(line), server["environment"]))
        assert_renders(place.url, {})
        rebound = httpx2.get(f"{place.url}/v1/jobs", headers={"Host": "rebound.example"}, timeout=TIMEOUT)
        assert (rebound.status_code, rebound.json()["code"]) == (421, "unknown_host")
