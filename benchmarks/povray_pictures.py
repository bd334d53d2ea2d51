"""Pictures by POV-Ray 3.7, in a process of its own; on Debian: `apt-get install povray`."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.machine import cpu_seconds
from benchmarks.povray_scene import LightGrid, description

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from schemas.scene import Scene


@dataclass(frozen=True)
class PovraySetting:
    """What decides the quality of a picture.

    Attributes
    ----------
    lights : LightGrid
    threshold : float or None
        Pixels whose neighbours differ by more are sampled again; None takes one sample a pixel.
    depth : int
        How far such a pixel is divided.
    method : {1, 2}
        1 takes depth x depth samples in every such pixel. 2 divides it where its corners differ, up to
        `depth` times in each direction.
    """

    lights: LightGrid
    threshold: float | None = None
    depth: int = 0
    method: int = 2

    @property
    def label(self) -> str:
        """The setting in a few words."""
        lights = f"{self.lights.side} x {self.lights.side} {self.lights.kind}"
        adaptive = "" if self.lights.adaptive is None else f" adaptive {self.lights.adaptive}"
        pixel = (
            "1 sample" if self.threshold is None else f"+A{self.threshold} +AM{self.method} +R{self.depth}"
        )
        return f"{pixel}, {lights}{adaptive}"


def version() -> str | None:
    """Version of the installed POV-Ray, or None if there is none."""
    program = shutil.which("povray")
    if program is None:
        return None
    banner = subprocess.run([program, "--version"], capture_output=True, text=True, check=False).stderr
    return next((word for line in banner.splitlines() for word in line.split() if word[:2] == "3."), "3")


def picture(scene: Scene, setting: PovraySetting) -> tuple[float, NDArray[np.float64]]:
    """Render a scene; gives CPU seconds of the whole process, and linear values in 0..1 of shape (H, W, 3).

    Raises
    ------
    ValueError
        If the scene is not translated.
    subprocess.CalledProcessError
        If POV-Ray fails.
    """
    return _run(description(scene, setting.lights), scene.camera.width, scene.camera.height, setting)


def start_seconds(scene: Scene) -> float:
    """CPU seconds of a picture of nothing, as large as the scene's: starting, and writing the file."""
    nothing = "#version 3.7;\nglobal_settings { assumed_gamma 1.0 }\n"
    one = PovraySetting(LightGrid(1, "points"))
    return _run(nothing, scene.camera.width, scene.camera.height, one)[0]


def _run(text: str, width: int, height: int, setting: PovraySetting) -> tuple[float, NDArray[np.float64]]:
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "scene.pov", Path(folder) / "picture.ppm"
        source.write_text(text)
        command = ["povray", f"+I{source}", f"+O{target}", f"+W{width}", f"+H{height}", *_options(setting)]
        begun = cpu_seconds()
        subprocess.run(command, capture_output=True, check=True, cwd=folder)
        seconds = cpu_seconds() - begun
        return seconds, _read_ppm(target.read_bytes(), width, height)


def _options(setting: PovraySetting) -> list[str]:
    """16 bits without gamma; the mean over a pixel is taken of linear values, at fixed places."""
    always = ["+FP16", "File_Gamma=1.0", "Antialias_Gamma=1.0", "-D", "-GA", "-J"]
    if setting.threshold is None:
        return [*always, "-A"]
    return [*always, f"+A{setting.threshold}", f"+AM{setting.method}", f"+R{setting.depth}"]


def _read_ppm(content: bytes, width: int, height: int) -> NDArray[np.float64]:
    """Values of a binary PPM of 16 bits, high byte first, after a header of any length."""
    levels = np.frombuffer(content[-6 * width * height :], ">u2").reshape(height, width, 3)
    return levels / np.iinfo(np.uint16).max
