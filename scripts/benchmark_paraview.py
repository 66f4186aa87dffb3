"""ParaView and texvol draw the same view of a made volume: seconds of each, beside the error; prints Markdown.

    sh scripts/setup.sh dask paraview
    .venv/bin/python scripts/benchmark_paraview.py --folder FOLDER [--samples 512] [--tf opaque] [--rounds 3]

ParaView is Debian's (`pvbatch` by `mpiexec`, under Xvfb) and has its settings, but for linear interpolation, no light,
no anti-aliasing (which smooths the picture of two ranks and not that of one), and a transfer function of the same
extinctions: its opacities are given for the length of one sample, on a grid twice as fine as the values. Its mapper
draws what lies between the outermost samples, and so texvol is told to crop half a sample on each side. Its distance of
samples is half of the volume's, which no setting changes; texvol draws with the same.

Both pictures are held against texvol's ray caster on the processor, in linear colours on black; ParaView's have 8 bits,
which alone is an rms error of 0.001. Each first picture is a command from start to end, with the files not in memory if
the system may be asked to forget them (only by root). Processor seconds are those of all processes.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import OpenImageIO as oiio
from benchmark_large import Large, forget_files
from benchmark_timing import Usage, columns, heading, machine, row, texvol_line, usage
from large_made import made_npy
from numpy.typing import NDArray
from processor_time import of_descendants

import texvol
from texvol import Camera, DistributedRenderer, Renderer, Scene, TransferFunction, Workers

Picture = NDArray[np.float64]
Seconds = tuple[float, float]  # wall, processor
_SIZE = (512, 512)
_RATE = 2.0  # samples per sample of the volume: ParaView's
_COARSER = (1.0, 1 / 2, 1 / 4, 1 / 8, 1 / 16)
_FRAMES = 3  # warm ones of a turn
_LARGEST_RMS = 2e-2  # of pictures of the same scene; a wrong axis or length differs by more
_EYE, _HEIGHT = np.array([1.85, 1.26, 1.06]), 1.76  # from the middle, in sides of the box
# Open MPI's: more ranks than cores, none bound to one core, and in a container as root.
_OF_MPI = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
}


@dataclass(frozen=True)
class View:
    """Volume, transfer function and camera of the pictures."""

    large: Large
    name: str  # of the transfer function
    folder: Path  # for files of the run

    @property
    def samples(self) -> int:
        """Samples along an axis."""
        return self.large.samples

    @property
    def camera(self) -> Camera:
        """Camera that looks at the middle of the box at an angle to all its axes."""
        middle = np.full(3, (self.samples - 1) / 2)
        eye = middle + self.samples * _EYE
        return Camera.orthographic(tuple(eye), tuple(middle), (0, 0, 1), height=self.samples * _HEIGHT)

    @property
    def function(self) -> TransferFunction:
        """The transfer function."""
        return TransferFunction.load(str(self.large.function(self.name)))

    @property
    def npy(self) -> Path:
        """The samples as a .npy file."""
        return made_npy(self.large.folder, self.samples)

    @property
    def raw(self) -> Path:
        """The samples as bytes and nothing else, which ParaView reads in a tenth of a second."""
        path = self.large.folder / f"made-{self.samples}.raw"
        if not path.exists():
            np.load(self.npy, mmap_mode="r").tofile(path)
        return path

    def scene(self, source: Path) -> Scene:
        """Return the scene of the samples in a file or store."""
        inside = (0.0, self.samples - 1.0)
        crop = (inside, inside, inside)
        return Scene(texvol.load(source), self.function, self.camera, classification="post", crop=crop)

    def line(self, source: Path, picture: Path, *more: object) -> list[str]:
        """Return the command of texvol."""
        camera, inside = self.camera, f"0,{self.samples - 1}"
        words: dict[str, object] = {
            "--tf": self.large.function(self.name),
            "--projection": "orthographic",
            "--eye": ",".join(map(repr, map(float, camera.eye))),
            "--target": ",".join(map(repr, map(float, camera.target))),
            "--up": "0,0,1",
            "--height": camera.height,
            "--size": "x".join(map(str, _SIZE)),
            "--classification": "post",
            "--crop": ",".join([inside] * 3),
            "-o": picture,
        }
        return texvol_line("render", source, *(word for pair in words.items() for word in pair), *more)

    def request(self, picture: Path, answer: Path, warm: int) -> Path:
        """Return the file from which `paraview_picture.py` takes what it is to draw."""
        function, camera = self.function, self.camera
        values = np.linspace(0, 255, 511)
        opacity = -np.expm1(-function.classify(values)[1])
        colors = [np.interp(values, function.values, function.colors[:, channel]) for channel in range(3)]
        points = [[value, rgb, alpha] for value, *rgb, alpha in np.column_stack([values, *colors, opacity]).tolist()]
        told = {
            "values": str(self.raw), "samples": self.samples, "points": points, "eye": list(camera.eye),
            "target": list(camera.target), "up": [0, 0, 1], "height": camera.height, "size": list(_SIZE),
            "warm": warm, "picture": str(picture), "answer": str(answer),
        }  # fmt: skip
        path = self.folder / "request.json"
        path.write_text(json.dumps(told))
        return path


class Contestant(Protocol):
    """Somebody who draws the view."""

    @property
    def names(self) -> tuple[object, ...]:
        """Cells of the table that say who it is."""

    def first(self, view: View) -> Usage:
        """Return what the command of a first picture takes."""

    def warm(self, view: View) -> tuple[list[Seconds], Picture]:
        """Return seconds of warm frames, drawn and read back, and the picture."""


@dataclass(frozen=True)
class ParaView:
    """So many ranks of pvbatch."""

    ranks: int
    display: str

    @property
    def names(self) -> tuple[object, ...]:
        """Cells of the table."""
        return f"ParaView, {self.ranks} rank{'s' * (self.ranks > 1)}", "raw bytes", f"{1 / _RATE:g}"

    def first(self, view: View) -> Usage:
        """Return what the command of a first picture takes."""
        forget_files()
        return self._ran(view, 0)

    def warm(self, view: View) -> tuple[list[Seconds], Picture]:
        """Return seconds of warm frames, and the picture."""
        self._ran(view, _FRAMES)
        answer = json.loads((view.folder / "answer.json").read_text())
        pixels = oiio.ImageBuf(str(view.folder / "paraview.png")).get_pixels(oiio.FLOAT)
        return list(zip(answer["wall"], answer["processor"], strict=True)), pixels[..., :3].astype(float)

    def _ran(self, view: View, warm: int) -> Usage:
        script = Path(__file__).with_name("paraview_picture.py")
        request = view.request(view.folder / "paraview.png", view.folder / "answer.json", warm)
        threads = max((os.cpu_count() or 1) // self.ranks, 1)
        environment = {**_OF_MPI, "DISPLAY": self.display, "LP_NUM_THREADS": str(threads), "PYTHONPATH": ""}
        line = [_program("mpiexec"), "-n", str(self.ranks), _program("pvbatch"), str(script), str(request)]
        return usage(line, **environment)


@dataclass(frozen=True)
class Texvol:
    """texvol by one process, or by so many workers."""

    source: str  # "npy" or "store"
    workers: int | None = None
    rate: float = _RATE

    @property
    def names(self) -> tuple[object, ...]:
        """Cells of the table."""
        workers = "one process" if self.workers is None else f"`--workers {self.workers}`"
        return f"texvol, {workers}", {"npy": ".npy", "store": "OME-Zarr"}[self.source], f"{1 / self.rate:g}"

    def first(self, view: View) -> Usage:
        """Return what the command of a first picture takes."""
        forget_files()
        more: list[object] = ["--level", 0] if self.source == "store" else []
        more += ["--workers", self.workers] if self.workers else []
        return usage(view.line(self._file(view), view.folder / "texvol.exr", "--sampling-rate", self.rate, *more))

    def warm(self, view: View) -> tuple[list[Seconds], Picture]:
        """Return seconds of warm frames, and the picture."""
        scene = view.scene(self._file(view))
        accuracy = {"sampling_rate": self.rate} | ({"level": 0} if self.source == "store" else {})
        found = []
        with self._renderer() as renderer:
            for _ in range(_FRAMES + 1):
                before, start = _processor_seconds(), time.perf_counter()
                picture = renderer.render(scene, _SIZE, **accuracy)  # type: ignore[arg-type]
                found.append((time.perf_counter() - start, _processor_seconds() - before))
        return found[1:], picture[..., :3].astype(float)

    @contextmanager
    def _renderer(self) -> Iterator[Renderer]:
        if self.workers is None:
            with Renderer() as alone:
                yield alone
        else:
            with Workers(self.workers) as workers, DistributedRenderer(workers) as renderer:
                yield renderer

    def _file(self, view: View) -> Path:
        return view.npy if self.source == "npy" else view.large.store


def _processor_seconds() -> float:
    return time.process_time() + of_descendants(os.getpid())


def _program(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        raise SystemExit(f"{name} must be installed: sh scripts/setup.sh dask paraview")
    return path


@contextmanager
def display() -> Iterator[str]:
    """Start Xvfb and return its display; it ends with the block."""
    read, write = os.pipe()
    # Without -noreset it restarts when its last client has gone, and turns away who comes meanwhile.
    line = [_program("Xvfb"), "-displayfd", str(write), "-noreset", "-screen", "0", "1024x768x24", "-nolisten", "tcp"]
    server = subprocess.Popen(line, pass_fds=(write,), stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as numbers:
            number = numbers.readline().strip()
        if not number:
            raise SystemExit("Xvfb has not started")
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


@dataclass(frozen=True)
class Measured:
    """Medians of one contestant, and the picture."""

    first: Seconds
    warm: Seconds
    picture: Picture


def measured(view: View, contestants: Sequence[Contestant], rounds: int) -> dict[Contestant, Measured]:
    """Let all contestants draw, one after the other, so many times."""
    firsts: dict[Contestant, list[Seconds]] = {each: [] for each in contestants}
    warms: dict[Contestant, list[Seconds]] = {each: [] for each in contestants}
    pictures = {}
    for turn in range(rounds):
        for number, each in enumerate(contestants):
            print(f"turn {turn + 1} of {rounds}: {number + 1} of {len(contestants)}", end="\r", file=sys.stderr)
            found = each.first(view)
            firsts[each].append((found.seconds, found.processor_seconds))
            frames, pictures[each] = each.warm(view)
            warms[each] += frames
    return {each: Measured(_median(firsts[each]), _median(warms[each]), pictures[each]) for each in contestants}


def _median(found: Sequence[Seconds]) -> Seconds:
    wall, processor = zip(*found, strict=True)
    return statistics.median(wall), statistics.median(processor)


def differences(one: Picture, other: Picture) -> tuple[float, float]:
    """Return the rms and the largest difference of two pictures."""
    apart = np.abs(one - other)
    return float(np.sqrt(np.mean(apart**2))), float(apart.max())


def as_good(view: View, exact: Picture, wanted: tuple[float, float]) -> Texvol | None:
    """Return texvol at the smallest rate whose errors are no larger than those that are wanted."""
    found = None
    with Renderer() as renderer:
        for rate in (_RATE, *_COARSER):
            picture = renderer.render(view.scene(view.npy), _SIZE, sampling_rate=rate)[..., :3]
            if any(own > most for own, most in zip(differences(picture, exact), wanted, strict=True)):
                break
            found = Texvol("npy", rate=rate)
    return found


def section(view: View, where: str, rounds: int) -> None:
    """Measure and print one transfer function."""
    heading(
        f"{view.samples}³, {view.name}",
        f"{_SIZE[0]}×{_SIZE[1]}, `post`. First picture: the whole command. Warm: drawn and read back. Distances of "
        "samples in those of the volume.",
    )
    exact = texvol.raycast(view.scene(view.npy), _SIZE)[..., :3]
    paraview = [ParaView(ranks, where) for ranks in (1, 2)]
    ours = [Texvol("npy"), Texvol("store"), Texvol("store", 1), Texvol("store", 2)]
    found = measured(view, [*paraview, *ours], rounds)
    coarse = as_good(view, exact, differences(found[paraview[0]].picture, exact))
    if coarse is not None and coarse not in found:
        found |= measured(view, [coarse], rounds)
    columns(
        "by", "reads", "distance", "first picture s (processor s)", "warm s (processor s)", "rms error",
        "largest error", "rms to ParaView", "largest",
    )  # fmt: skip
    for each, result in found.items():
        own, apart = (differences(result.picture, other) for other in (exact, found[paraview[0]].picture))
        if apart[0] > _LARGEST_RMS:
            raise SystemExit(f"{each.names[0]} and ParaView draw different scenes (rms {apart[0]:.2g})")
        times = (f"{wall:.3g} ({processor:.3g})" for wall, processor in (result.first, result.warm))
        row(*each.names, *times, *(f"{error:.2g}" for error in (*own, *apart)))


def main() -> None:
    """Print the sections."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])  # type: ignore[union-attr]
    parser.add_argument("--folder", type=Path, required=True, help="where the volume is, or is made")
    parser.add_argument("--samples", type=int, default=512, help="along an axis (512)")
    parser.add_argument("--tf", default="translucent", help="translucent,opaque (translucent)")
    parser.add_argument("--rounds", type=int, default=2, help="turns of which medians are taken (2)")
    arguments = parser.parse_args()
    for program in ("pvbatch", "mpiexec"):
        _program(program)
    arguments.folder.mkdir(parents=True, exist_ok=True)
    large = Large(arguments.folder, arguments.samples, "4GB", arguments.rounds)
    print(f"{machine()} {_version()}. Files forgotten before each command: {'yes' if forget_files() else 'no'}.")
    with tempfile.TemporaryDirectory(prefix="texvol-paraview-") as folder, display() as where:
        for name in arguments.tf.split(","):
            section(View(large, name, Path(folder)), where, arguments.rounds)


def _version() -> str:
    done = subprocess.run([_program("pvbatch"), "--version"], capture_output=True, text=True)
    return done.stdout.strip() or done.stderr.strip()


if __name__ == "__main__":
    main()
