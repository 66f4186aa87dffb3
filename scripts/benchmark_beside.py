"""Other programs as competitors of the benchmark: each in a process and an environment of its own.

They are given the samples, a table of the transfer function in linear light, extinctions per smallest spacing, and the
camera. Before it is measured each draws a soft version of the scene: where its picture differs from texvol's, it draws
another model, and says so.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import tempfile
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_competitors import RATES, Frame, Trial, Walker
from benchmark_scenes import SIZE, rms
from numpy.typing import NDArray
from plain_marcher import lookup_table

from texvol import Renderer, Scene
from texvol.report.vtk_mappers import MOST_DIFFERENT, in_right_handed_order, right_handed, soft_scene, view_in_grid

ENVIRONMENT = Path(__file__).resolve().parents[1] / ".venv-others"
_CHECK_RATE = 2.0
_DRAWN = 1e-6  # what a picture has at most where nothing has been drawn into it
_START_SECONDS = 120.0  # the first frame may compile
_LLVM = ("libLLVM.so.19.1", "libLLVM-19.so", "libLLVM-16.so.1")  # Mitsuba's compiler fails by older ones


@dataclass(frozen=True)
class Other:
    """Another program and what may be asked of it."""

    name: str
    module: str
    families: tuple[str, ...]
    rates: tuple[float, ...]  # samples of a smallest spacing, or what else `unit` says
    unit: str  # of a setting in words; empty: the distance of samples
    check_rate: float
    note: str  # how it differs from texvol where its figures stand


_WALKS = tuple(2.0**power for power in range(0, 13))
OTHERS = (
    Other("pyvista", "pyvista", ("gpu", "fixed_point"), RATES, "", _CHECK_RATE,
          "VTK's mappers; table and pictures of 8 bits"),
    Other("vispy", "vispy", ("translucent",), RATES, "", _CHECK_RATE,
          "opacities given for each step; rays end at an opacity of 0.99"),
    Other("yt", "yt", ("",), tuple(2.0**power for power in range(9)), "steps a cell", _CHECK_RATE,
          "a step lets 1 - τd through"),
    Other("Mitsuba 3", "mitsuba", ("",), _WALKS, "walks", 256.0, "no bias; noise"),
    Other("pynari", "pynari", ("",), _WALKS, "paths", 64.0, "scatters light, emits none"),
)  # fmt: skip


class OtherError(Exception):
    """Another program is missing, fails or draws another picture; the message gives the reason."""


class Beside(Walker):
    """Another program; closing it ends its process."""

    def __init__(
        self, other: Other, renderer: Renderer, scene: Scene, truth: NDArray[np.float64], time_limit: float
    ) -> None:
        super().__init__(truth, time_limit)
        self.name, self.rates, self.note, self._other = other.name, other.rates, other.note, other
        self._renderer, self._scene = renderer, scene
        self._closing = contextlib.ExitStack()
        self._process: subprocess.Popen[str] | None = None

    def families(self) -> Iterable[str]:
        """Return the names of the program's kinds of settings."""
        return self._other.families

    def setting(self, family: str, rate: float, wanted: float) -> tuple[Any, str]:
        """Family and rate; whole numbers where it counts."""
        if self._other.unit:
            rate = float(max(round(rate), 1))
        words = f"{rate:g} {self._other.unit}" if self._other.unit else f"{1 / rate:.3g}"
        return (family, rate), ", ".join(filter(None, (family if len(self._other.families) > 1 else "", words)))

    def frame(self, setting: Any) -> Frame:
        """Ask for one frame of the scene."""
        return self.asked("scene", *setting)

    def search(self) -> None:
        """Check that it draws the scene, then try its settings."""
        try:
            self._start()
            self._check()
            super().search()
        except OtherError as error:
            self.problem = str(error)

    def again(self, trials: Sequence[Trial]) -> dict[Trial, tuple[float, float]]:
        """Two frames of each, if it is still there."""
        try:
            return super().again(trials)
        except OtherError as error:
            self.problem = str(error)
            return {}

    def close(self) -> None:
        """End the process."""
        self._closing.close()
        self._process = None

    def asked(self, medium: str, family: str, rate: float) -> Frame:
        """Return one frame."""
        assert self._process is not None and self._process.stdin is not None
        path = self._folder / "picture.npy"
        asked = {"medium": medium, "family": family, "rate": rate, "picture": str(path)}
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(asked) + "\n")
            self._process.stdin.flush()
        answer = self._answer(self.time_limit + _START_SECONDS)
        return Frame(answer["seconds"], answer["processor_seconds"], np.load(path))

    def _start(self) -> None:
        python = ENVIRONMENT / "bin" / "python"
        if not python.exists():
            raise OtherError("not installed: sh scripts/setup.sh '' others")
        self._folder = Path(self._closing.enter_context(tempfile.TemporaryDirectory(prefix="texvol-beside-")))
        write_request(self._folder, self._scene)
        self._errors = self._closing.enter_context((self._folder / "errors").open("w+"))
        line = [str(python), str(Path(__file__).with_name("side_process.py")), self._other.module, str(self._folder)]
        self._process = subprocess.Popen(
            line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True, env=environment()
        )
        self._closing.callback(self._end, self._process)
        self.about = self._answer(_START_SECONDS)["about"]

    def _check(self) -> None:
        soft = replace(soft_scene(self._scene), classification="post")
        ours = self._renderer.render(soft, SIZE, sampling_rate=_CHECK_RATE)
        picture = self.asked("check", self._other.families[0], self._other.check_rate).picture
        if not np.abs(picture).max() > _DRAWN:
            raise OtherError(f"draws nothing of this view ({self._scene.completed(SIZE).camera.projection} camera)")
        found = rms(picture, ours)
        if not found <= MOST_DIFFERENT:
            raise OtherError(f"draws another model, {self._other.note} (rms {found:.2g} of a soft version)")

    def _answer(self, seconds: float) -> dict[str, Any]:
        process = self._process
        assert process is not None and process.stdout is not None
        watch = threading.Timer(seconds, process.kill)
        watch.start()
        try:
            line = process.stdout.readline()
        finally:
            watch.cancel()
        if line:
            found: dict[str, Any] = json.loads(line)
            return found
        self._errors.seek(0)
        last = (self._errors.read().strip().splitlines() or ["no reason given"])[-1]
        raise OtherError(f"its process ended with status {process.wait()}: {last[:200]}")

    @staticmethod
    def _end(process: subprocess.Popen[str]) -> None:
        process.kill()
        process.communicate()


def environment() -> dict[str, str]:
    """Environment variables of the processes: no display, and a compiler for Mitsuba."""
    found = {"EGL_PLATFORM": "surfaceless", "VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow", "PYTHONPATH": ""}
    libraries = [path for name in _LLVM for path in Path("/usr/lib").glob(f"*/{name}")]
    if libraries:
        found["DRJIT_LIBLLVM_PATH"] = str(libraries[0])
    return os.environ | found


def write_request(folder: Path, scene: Scene) -> None:
    """Write what `side_given.Given` and `side_process` read."""
    volume, view = scene.volume, view_in_grid(scene, SIZE)
    unit = volume.smallest_spacing
    axes, corner = right_handed(volume)
    camera = scene.completed(SIZE).camera
    world_from_box = np.eye(4)
    world_from_box[:3, :3], world_from_box[:3, 3] = axes * unit, corner
    near, far = np.array(view["camera"]["range"]) * unit
    clip_from_box = camera.clip_from_eye(SIZE[0] / SIZE[1], near, far) @ camera.eye_from_world @ world_from_box
    origins, directions = camera.rays(SIZE)
    np.save(folder / "rays.npy", np.stack([(origins - corner) @ axes / unit, directions @ axes]))
    values = in_right_handed_order(volume, volume.values).astype(np.float32)
    np.save(folder / "values.npy", np.ascontiguousarray(values))
    media = {"scene": scene, "check": soft_scene(scene)}
    told = view | {"clip_from_box": clip_from_box.tolist(), "media": {each: table(media[each]) for each in media}}
    (folder / "request.json").write_text(json.dumps(told))


def table(scene: Scene) -> dict[str, Any]:
    """Return a scene's transfer function as a table over the values of its volume, extinctions per smallest spacing."""
    assert scene.transfer_function is not None
    low, high = scene.volume.finite_range or (0.0, 1.0)
    entries = lookup_table(scene.transfer_function.classify, low, high)
    entries[:, 3] *= scene.volume.smallest_spacing
    return {"low": float(low), "high": float(high), "table": entries.tolist()}
