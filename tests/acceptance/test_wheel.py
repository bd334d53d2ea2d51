"""The package as users get it: built once, and installed in fresh environments, one for each extra.

Packages come from a package index in the versions of this environment. Where none answers, tests are skipped.
"""

import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Callable
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from tests.acceptance.test_grading import grey_assignment
from tests.postgres_server import PostgresServer, programs
from tests.s3_server import BUCKET, S3Server
from tests.service.cli.conftest import CLEAN, ROOT, Outcome
from tests.service.support import scene

pytestmark = pytest.mark.slow

TIMEOUT = 300
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES: list[str] = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
EXTRAS = sorted(PROJECT["project"]["optional-dependencies"])
GALLERY = ROOT / "scenes" / "gallery"
# Nothing is compiled as it is installed, to save time: what is imported has to stay compiled.
LEFT_OUT = ("PYTHONPATH", "PYTHONDONTWRITEBYTECODE", "VIRTUAL_ENV", "OTEL_", "AWS_")
VARIABLES = {name: value for name, value in CLEAN.items() if not name.startswith(LEFT_OUT)}


CLOSED = "http://127.0.0.1:9"
NO_SERVER = "error: A service needs more packages. Install them with: pip install 'penumbra-render[server]'"


class Environment:
    """A fresh environment of Python, used from a folder that is not the checkout."""

    def __init__(self, root: Path) -> None:
        self.root, self.folder = root / "env", root / "work"
        self.folder.mkdir()

    def run(self, *words: object, **changes: str) -> Outcome:
        """Run the Python of the environment."""
        done = subprocess.run(
            [self.root / "bin" / "python", *map(str, words)],
            capture_output=True,
            text=True,
            cwd=self.folder,
            env=VARIABLES | changes,
            timeout=TIMEOUT,
            check=False,
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    def penumbra(self, *words: object, **changes: str) -> Outcome:
        """Run a command of the package."""
        return self.run("-m", "service.cli.main", *words, **changes)

    def install(self, *words: object) -> None:
        """Install packages in the versions of this process's own environment."""
        chosen = self.folder / "constraints.txt"
        here = {found.name: found.version for found in distributions()}
        for name in (PROJECT["project"]["name"], "pip"):
            here.pop(name, None)
        chosen.write_text("".join(f"{name}=={version}\n" for name, version in here.items()))
        command = [sys.executable, "-m", "pip", "--python", str(self.root / "bin" / "python"), "install"]
        command += ["--quiet", "--no-compile", "--retries", "1", "--constraint", str(chosen)]
        done = subprocess.run([*command, *map(str, words)], capture_output=True, text=True, check=False)
        if "Could not find a version" in done.stderr:
            pytest.skip("No package index has what the package needs: is there a network?")
        assert done.returncode == 0, done.stdout + done.stderr


def fresh(folder: Path) -> Environment:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder / "env")], check=True)
    return Environment(folder)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel as one command makes it, from the source archive that it makes before."""
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (found,) = out.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def plain(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """A fresh environment with the wheel and no extra."""
    made = fresh(tmp_path_factory.mktemp("plain"))
    made.install(wheel)
    return made


@pytest.fixture(scope="module")
def with_server(wheel: Path, plain: Environment, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    made = extended(plain, "server", wheel, tmp_path_factory.mktemp("server"))
    # Compiles it once: the processes of a service would each do so, and be slow to start.
    made.run("-c", "import service.app, service.server, service.workers.worker")
    return made


def extended(environment: Environment, extra: str, wheel: Path, folder: Path) -> Environment:
    """A copy of an environment, with an extra."""
    # Links take no time and no space; pip replaces files and changes none.
    shutil.copytree(environment.root, folder / "env", symlinks=True, copy_function=os.link)
    made = Environment(folder)
    made.install(f"{wheel}[{extra}]")
    return made


def test_wheel_has_every_file_of_the_packages(wheel: Path) -> None:
    found = (path for name in PACKAGES for path in (ROOT / name).rglob("*") if path.is_file())
    sources = {str(path.relative_to(ROOT)) for path in found if "__pycache__" not in path.parts}
    with zipfile.ZipFile(wheel) as archive:
        assert {name for name in archive.namelist() if ".dist-info/" not in name} == sources


def test_fresh_environment_renders_grades_and_reaches_services(plain: Environment) -> None:
    command = [plain.root / "bin" / "penumbra", "--version"]
    said = subprocess.run(command, env=VARIABLES, capture_output=True, text=True, check=True)
    assert said.stdout == f"{PROJECT['project']['version']}\n"
    (plain.folder / "small.json").write_text(json.dumps(scene(8, 8, samples=1)))
    assert plain.penumbra("render", "small.json", "-o", "small.png").code == 0
    assignment = grey_assignment(plain.folder / "grey")
    graded = plain.penumbra("grade", assignment / "manifest.yaml", "--submission", assignment, "--json")
    assert graded.code == 0, graded.err
    assert graded.document["score"] == graded.document["max_score"] == 10
    assert "There is no server at" in plain.penumbra("submit", "small.json", "--server", CLOSED).err
    assert plain.penumbra("doctor").code == 0
    assert " ".join(plain.penumbra("keys", "ls").err.split()) == NO_SERVER


def test_server_runs_the_demo(with_server: Environment) -> None:
    done = with_server.penumbra("demo", "--json")
    assert done.code == 0, done.err
    job = done.document["job"]
    assert job["state"] == "succeeded"
    assert done.document["first_pixels_seconds"] < done.document["seconds"]
    assert "tile " in done.err
    with Image.open(with_server.folder / "out" / "demo.png") as picture:
        assert picture.size == (job["width"], job["height"])


def test_client_needs_three_packages(wheel: Path, tmp_path: Path) -> None:
    alone = fresh(tmp_path)
    alone.install("httpx2", "pydantic", "numpy")
    alone.install("--no-deps", wheel)
    program = f"""
import pkgutil, importlib, service.client
for module in pkgutil.walk_packages(service.client.__path__, "service.client."):
    importlib.import_module(module.name)
try:
    list(service.client.Client("{CLOSED}").jobs())
except service.client.UnreachableError as error:
    print(type(error).__name__)
"""
    done = alone.run("-c", program)
    assert (done.out, done.code) == ("UnreachableError\n", 0), done.err


Said = tuple[bool, str]
"""Whether a feature worked, and all that was written on the way."""


def exr(place: Environment) -> Said:
    done = place.penumbra("render", GALLERY / "basic.json", "-o", "picture.exr", "--samples", 1)
    return done.code == 0, done.err


def mesh(place: Environment) -> Said:
    """A face like an arrow: all that is not concave needs no extra."""
    arrow = scene(8, 8, samples=1)
    arrow["shapes"] = [{"type": "mesh", "asset": "arrow.obj", "material": "ball"}]
    (place.folder / "arrow.obj").write_text("v -1 0 0\nv 1 0 0\nv 0 2 0\nv 0 0.5 0\nf 1 4 2 3\n")
    (place.folder / "arrow.json").write_text(json.dumps(arrow))
    done = place.penumbra("render", "arrow.json", "-o", "picture.png")
    return done.code == 0, done.err


def flip(place: Environment) -> Said:
    picture = ROOT / "docs" / "images" / "gallery" / "basic.png"
    done = place.penumbra("compare", picture, picture, "--flip", "--json")
    return done.code == 0 and done.document["metrics"]["flip"] == 0, done.out + done.err


def study(place: Environment) -> Said:
    done = place.penumbra("study", GALLERY / "basic.json", "--out", "study", "--quick", "--budget", "0.1")
    return done.code == 0 and any((place.folder / "study" / "images").glob("*.svg")), done.err


def dask(place: Environment) -> Said:
    """A service with this engine renders a job."""
    (place.folder / "small.json").write_text(json.dumps(scene(24, 24)))
    program = """
from service.client import Client
from service.server import running
from service.settings import Settings
settings = Settings(data="served", port=0, workers=1, engine="dask")
with running(settings) as server, Client(server.url) as client:
    print(client.wait(client.submit("small.json").id).state)
"""
    done = place.run("-c", program)
    return done.out == "succeeded\n", done.err


def traces(place: Environment) -> Said:
    return found_by_doctor(place, "traces", OTEL_EXPORTER_OTLP_ENDPOINT="http://127.0.0.1:9")


def postgres(place: Environment) -> Said:
    found = programs()
    if found is None:
        pytest.skip(
            "no programs of PostgreSQL (initdb, postgres) on this machine: apt-get install postgresql"
        )
    server = PostgresServer(found)
    try:
        return found_by_doctor(place, "database", PENUMBRA_DATABASE=server.database())
    finally:
        server.close()


def s3(place: Environment) -> Said:
    server = S3Server()
    try:
        return found_by_doctor(place, "store", PENUMBRA_STORE=f"s3://{BUCKET}", **server.environment())
    finally:
        server.close()


def found_by_doctor(place: Environment, name: str, **changes: str) -> Said:
    checks = place.penumbra("doctor", "--json", **changes).document["checks"]
    (check,) = (check for check in checks if check["name"] == name)
    return check["level"] == "ok", f"{check['found']} {check['advice']}"


PROMISES: dict[str, Callable[[Environment], Said]] = {
    promise.__name__: promise for promise in (dask, exr, flip, mesh, postgres, s3, study, traces)
}


@pytest.mark.parametrize("extra", sorted(set(EXTRAS) - {"server"}))
def test_extra_does_what_it_promises_and_is_named_without_it(
    extra: str, wheel: Path, plain: Environment, with_server: Environment, tmp_path: Path
) -> None:
    works, said = PROMISES[extra](with_server)
    assert not works
    assert f"pip install 'penumbra-render[{extra}]'" in said.replace("\n", " ")
    works, said = PROMISES[extra](extended(plain, extra, wheel, tmp_path))
    assert works, said
