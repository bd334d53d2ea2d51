"""The package as users get it: built once, and installed in fresh environments, one for each extra.

Packages come from a package index in the versions of this environment. Where none answers, tests are skipped.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from tests.acceptance.conftest import ROOT
from tests.postgres_server import PostgresServer, programs
from tests.s3_server import BUCKET, S3Server
from tests.service.collector import collecting

pytestmark = pytest.mark.slow

TIMEOUT = 300
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES: list[str] = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
EXTRAS = sorted(PROJECT["project"]["optional-dependencies"])
GALLERY = ROOT / "scenes" / "gallery"
CLIENT = ("httpx2", "pydantic", "numpy")
"""What the client imports, apart from what these need themselves."""


def variables() -> dict[str, str]:
    """This process's environment without what would lead to this checkout, or change what is tried."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PENUMBRA_", "OTEL_", "AWS_"))
    }
    # Nothing is compiled as it is installed, to save time: what is imported has to stay compiled.
    left_out = {"PYTHONPATH", "VIRTUAL_ENV", "PYTHONDONTWRITEBYTECODE"}
    return {name: value for name, value in kept.items() if name not in left_out}


@dataclass(frozen=True)
class Environment:
    """A fresh environment of Python, used from a folder that is not the checkout."""

    root: Path
    folder: Path

    @property
    def python(self) -> Path:
        return self.root / "bin" / "python"

    def run(self, *words: object, **changes: str) -> subprocess.CompletedProcess[str]:
        """Run the Python of the environment."""
        return subprocess.run(
            [self.python, *map(str, words)],
            capture_output=True,
            text=True,
            cwd=self.folder,
            env=variables() | changes,
            timeout=TIMEOUT,
            check=False,
        )

    def penumbra(self, *words: object, **changes: str) -> subprocess.CompletedProcess[str]:
        """Run a command of the package."""
        return self.run("-m", "service.cli.main", *words, **changes)

    def succeeds(self, *words: object, **changes: str) -> str:
        """Run a command that must succeed, and return what it printed to stdout."""
        done = self.penumbra(*words, **changes)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def install(self, *words: object) -> None:
        """Install packages in the versions of this process's own environment."""
        chosen = self.root / "constraints.txt"
        chosen.unlink(missing_ok=True)
        chosen.write_text("".join(sorted(_installed_here())))
        command = [sys.executable, "-m", "pip", "--python", str(self.python), "install", "--quiet"]
        command += ["--no-compile", "--retries", "1", "--constraint", str(chosen), *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
        if "Could not find a version" in done.stderr:
            pytest.skip("No package index has what the package needs: is there a network?")
        assert done.returncode == 0, done.stdout + done.stderr


def _installed_here() -> Iterator[str]:
    """The packages of this process's own environment as lines of a file of constraints."""
    for found in distributions():
        if found.name not in {PROJECT["project"]["name"], "pip"}:
            yield f"{found.name}=={found.version}\n"


@dataclass(frozen=True)
class Built:
    """The two files of a release."""

    wheel: Path
    source: Path


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Both as one command makes them: the source archive, and from it the wheel."""
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    ((wheel,), (source,)) = (list(out.glob(pattern)) for pattern in ("*.whl", "*.tar.gz"))
    return Built(wheel, source)


@pytest.fixture(scope="module")
def plain(built: Built, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """A fresh environment with the wheel and no extra."""
    made = fresh(tmp_path_factory.mktemp("plain"))
    made.install(built.wheel)
    # Compiles it once: the processes of a service would each do so, and be slow to start.
    made.run("-c", "import service.app, service.server, service.workers.worker")
    return made


def fresh(folder: Path) -> Environment:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder / "env")], check=True)
    (folder / "work").mkdir()
    return Environment(folder / "env", folder / "work")


def sources() -> set[str]:
    """Files of the packages, as the wheel has to name them."""
    found = (path for name in PACKAGES for path in (ROOT / name).rglob("*") if path.is_file())
    return {str(path.relative_to(ROOT)) for path in found if "__pycache__" not in path.parts}


def test_wheel_has_every_file_of_the_packages(built: Built) -> None:
    with zipfile.ZipFile(built.wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert names == sources()
    kinds = ("service/web/index.html", "service/web/vendor/", "service/storage/database/migrations/versions/")
    kinds += ("scenes/gallery/textures/", "scenes/gallery/meshes/", "scenes/assignment/references/")
    kinds += ("service/py.typed",)
    assert [kind for kind in kinds if not any(name.startswith(kind) for name in names)] == []


def test_source_archive_has_tests_and_pages(built: Built) -> None:
    with tarfile.open(built.source) as archive:
        tops = {name.split("/")[1] for name in archive.getnames()}
    assert {
        *PACKAGES,
        "tests",
        "docs",
        "tools",
        "benchmarks",
        "deploy",
        "Makefile",
        "constraints.txt",
    } <= tops
    assert not tops & {".ci", ".venv", "out", "dist"}


def test_installed_command_prints_the_version(plain: Environment) -> None:
    command = [plain.root / "bin" / "penumbra", "--version"]
    said = subprocess.run(
        command, cwd=plain.folder, env=variables(), capture_output=True, text=True, check=True
    )
    assert said.stdout == f"{PROJECT['project']['version']}\n"


def test_fresh_environment_runs_the_demo(plain: Environment) -> None:
    document = json.loads(plain.succeeds("demo", "--json"))
    assert document["job"]["state"] == "succeeded"
    with Image.open(plain.folder / "out" / "demo.png") as picture:
        assert picture.size == (document["job"]["width"], document["job"]["height"])


def test_client_needs_three_packages(built: Built, tmp_path: Path) -> None:
    alone = fresh(tmp_path)
    alone.install(*CLIENT)
    alone.install("--no-deps", built.wheel)
    program = """
import pkgutil, importlib, service.client
for module in pkgutil.walk_packages(service.client.__path__, "service.client."):
    importlib.import_module(module.name)
try:
    list(service.client.Client("http://127.0.0.1:9").jobs())
except service.client.UnreachableError as error:
    print(type(error).__name__)
"""
    done = alone.run("-c", program)
    assert (done.stdout, done.returncode) == ("UnreachableError\n", 0), done.stderr


Said = tuple[bool, str]
"""Whether a feature worked, and all that was written on the way."""


def _rendered(place: Environment, *words: object) -> Said:
    done = place.penumbra("render", *words, "--samples", "1", "--light-samples", "1")
    return done.returncode == 0, done.stderr


def exr(place: Environment) -> Said:
    return _rendered(place, GALLERY / "basic.json", "-o", "picture.exr")


def mesh(place: Environment) -> Said:
    """A face like an arrow: all that is not concave needs no extra."""
    arrow = "v -1 0 0\nv 1 0 0\nv 0 2 0\nv 0 0.5 0\nf 1 4 2 3\n"
    (place.folder / "arrow.obj").write_text(arrow)
    material = {"type": "phong", "color": [1, 1, 1]}
    document = {
        "version": 1,
        "camera": {"position": [0, 1, 5], "look_at": [0, 1, 0], "width": 8, "height": 8},
        "materials": {"plain": material},
        "shapes": [{"type": "mesh", "asset": "arrow.obj", "material": "plain"}],
    }
    (place.folder / "arrow.json").write_text(json.dumps(document))
    return _rendered(place, place.folder / "arrow.json", "-o", "picture.png")


def flip(place: Environment) -> Said:
    picture = ROOT / "docs" / "images" / "gallery" / "basic.png"
    done = place.penumbra("compare", picture, picture, "--flip", "--json")
    return done.returncode == 0 and json.loads(done.stdout)["metrics"]["flip"] == 0, done.stdout + done.stderr


def study(place: Environment) -> Said:
    done = place.penumbra("study", GALLERY / "basic.json", "--out", "study", "--quick", "--budget", "0.1")
    return done.returncode == 0 and any((place.folder / "study" / "images").glob("*.svg")), done.stderr


def _served(place: Environment, **changes: str) -> Said:
    """Whether a service renders a small job."""
    scene = json.loads((GALLERY / "basic.json").read_text())
    scene["camera"] |= {"width": 24, "height": 24}
    (place.folder / "small.json").write_text(json.dumps(scene))
    program = """
from service.client import Client
from service.server import running
from service.settings import Settings
with running(Settings(data="served", port=0, workers=1)) as server, Client(server.url) as client:
    print(client.wait(client.submit("small.json").id).state)
"""
    done = place.run("-c", program, **changes)
    return done.stdout == "succeeded\n", done.stderr


def dask(place: Environment) -> Said:
    return _served(place, PENUMBRA_ENGINE="dask")


def traces(place: Environment) -> Said:
    with collecting() as collector:
        ready, said = _doctor(place, "traces", OTEL_EXPORTER_OTLP_ENDPOINT=collector.url)
        if not ready:
            return False, said
        works, said = _served(place, OTEL_EXPORTER_OTLP_ENDPOINT=collector.url)
        return works and bool(collector.names()), said


def postgres(place: Environment) -> Said:
    found = programs()
    if found is None:
        pytest.skip(
            "no programs of PostgreSQL (initdb, postgres) on this machine: apt-get install postgresql"
        )
    server = PostgresServer(found)
    try:
        return _doctor(place, "database", PENUMBRA_DATABASE=server.database())
    finally:
        server.close()


def s3(place: Environment) -> Said:
    server = S3Server()
    try:
        return _doctor(place, "store", PENUMBRA_STORE=f"s3://{BUCKET}", **server.environment())
    finally:
        server.close()


def _doctor(place: Environment, name: str, **changes: str) -> Said:
    done = place.penumbra("doctor", "--json", **changes)
    (check,) = (check for check in json.loads(done.stdout)["checks"] if check["name"] == name)
    return check["level"] == "ok", f"{check['found']} {check['advice']}"


PROMISES: dict[str, Callable[[Environment], Said]] = {
    promise.__name__: promise for promise in (dask, exr, flip, mesh, postgres, s3, study, traces)
}


def test_extras_all_promise_something() -> None:
    assert sorted(PROMISES) == EXTRAS


@pytest.mark.parametrize("extra", EXTRAS)
def test_extra_does_what_it_promises_and_is_named_without_it(
    extra: str, built: Built, plain: Environment, tmp_path: Path
) -> None:
    works, said = PROMISES[extra](plain)
    assert not works
    assert f"pip install 'penumbra-render[{extra}]'" in said.replace("\n", " ")
    # Links take no time and no space; pip replaces files and changes none.
    shutil.copytree(plain.root, tmp_path / "env", symlinks=True, copy_function=os.link)
    (tmp_path / "work").mkdir()
    extended = Environment(tmp_path / "env", tmp_path / "work")
    extended.install(f"{built.wheel}[{extra}]")
    works, said = PROMISES[extra](extended)
    assert works, said
