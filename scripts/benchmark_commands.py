"""Whole commands, start to finish: memory, a cold start to a file, and many views of one volume."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
from benchmark_scenes import SIZE, built_in
from benchmark_timing import Run, columns, frame_seconds, heading, in_turns, process, row, texvol_line

from texvol import Renderer, Scene

_PROGRAM_MEGABYTES, _TEXTURE_FRACTION = 150, 1.2  # what a whole command is to fit in, beside the data
_VTK = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
_FINE_GRID = 256  # of opacities, which VTK interpolates instead of extinctions


def memory(run: Run) -> None:
    """Print the section on memory."""
    heading(
        "Memory",
        f"Peak of the whole command `texvol render`, megabytes (10⁶), beside data + {_TEXTURE_FRACTION} × texture + "
        f"{_PROGRAM_MEGABYTES}.",
    )
    columns("n", "values", "data", "texture", "allowed", "peak", "peak with --stats", "within")
    for samples in (64, 128) if run.quick else (128, 256, 384):
        for dtype in ("uint8", "uint16", "float32"):
            scene = built_in("bone", samples, dtype)
            data = scene.volume.values.nbytes / 1e6
            line = texvol_line("render", *_files(run.folder, scene), "-o", run.folder / "memory.png")
            stats = run.folder / "stats.json"
            rounds = range(min(run.rounds, 3))
            peak = median(process(line)[1] for _ in rounds)
            with_stats = median(process([*line, "--stats", str(stats)])[1] for _ in rounds)
            texture = json.loads(stats.read_text())["texture_bytes"] / 1e6
            allowed = data + _TEXTURE_FRACTION * texture + _PROGRAM_MEGABYTES
            row(
                samples,
                dtype,
                *(f"{each:.0f}" for each in (data, texture, allowed, peak, with_stats)),
                "yes" if max(peak, with_stats) <= allowed else "peak only" if peak <= allowed else "no",
            )


def cold(run: Run) -> None:
    """Print the section on a cold start."""
    heading(
        "Cold start to a file",
        "A 128³ NPY to a 512×512 PNG, the whole process, orthographic, one sample per voxel: the `texvol` command, and "
        "a script that does the same with VTK's GPU mapper under EGL. Seconds, and peak megabytes.",
    )
    columns("values", "texvol s", "MB", "VTK s", "MB", "ratio")
    script = Path(__file__).parent / "benchmark_vtk_picture.py"
    for dtype in ("uint8", "uint16", "float32"):
        scene = built_in("bone", 128, dtype)
        values, *options = _files(run.folder, scene)
        (run.folder / "vtk.json").write_text(json.dumps(vtk_scene(scene)))
        lines = {
            "texvol": texvol_line("render", values, *options, "-o", run.folder / "cold.png"),
            "VTK": [sys.executable, str(script), values, str(run.folder / "vtk.json"), str(run.folder / "vtk.png")],
        }
        memories: dict[str, float] = {}

        def whole(name: str, lines: dict[str, list[str]] = lines, memories: dict[str, float] = memories) -> float:
            seconds, memories[name] = process(lines[name], **_VTK)
            return seconds

        times = in_turns({name: lambda name=name: whole(name) for name in lines}, 2 * run.rounds)
        row(
            dtype,
            *(cell for name in lines for cell in (f"{times[name]:.2f}", f"{memories[name]:.0f}")),
            f"{times['VTK'] / times['texvol']:.2f}",
        )


def orbit(run: Run) -> None:
    """Print the section on views in a row."""
    samples, views = (64, 6) if run.quick else (128, 24)
    heading(
        "Many views",
        f"`texvol render --orbit N` to numbered PNG files, {samples}³ uint8, 512×512. Frames a second of the whole "
        f"command, of what each view more costs ({views} beside {3 * views}), and of warm frames in one process.",
    )
    columns("whole command", "each view more", "warm frames")
    scene = built_in("bone", samples, "uint8")

    def command(count: int) -> float:
        folder = run.folder / f"orbit-{count}"
        folder.mkdir(exist_ok=True)
        line = texvol_line("render", *_files(run.folder, scene), "--orbit", count, "-o", folder / "frame_%04d.png")
        seconds, _ = process(line)
        written = len(list(folder.glob("frame_*.png")))
        if written != count:
            raise RuntimeError(f"{written} pictures were written, and not {count}")
        return seconds

    with Renderer() as renderer:
        try:
            times = in_turns(
                {
                    "few": lambda: command(views),
                    "many": lambda: command(3 * views),
                    "warm": lambda: frame_seconds(renderer, _as_drawn(scene), SIZE),
                },
                run.rounds,
            )
        except RuntimeError as error:
            print(f"\nNot measured: {error}", flush=True)
            return
    each = (times["many"] - times["few"]) / (2 * views)
    row(*(f"{rate:.1f}" for rate in (3 * views / times["many"], 1 / each, 1 / times["warm"])))


def vtk_scene(scene: Scene) -> dict[str, object]:
    """The scene for `benchmark_vtk_picture.py`."""
    camera, points = scene.completed(SIZE).camera, scene.transfer_function
    assert points is not None
    grid = np.unique(np.concatenate([np.linspace(points.values[0], points.values[-1], _FINE_GRID), points.values]))
    numbers = points.at(grid)
    opacity = -np.expm1(-numbers[:, 3])
    return {
        "points": np.column_stack([grid, numbers[:, :3], opacity]).tolist(),
        "eye": list(camera.eye),
        "target": list(camera.target),
        "up": list(camera.up),
        "height": camera.height,
        "size": list(SIZE),
        "distance": 1.0,
    }


def _as_drawn(scene: Scene) -> Scene:
    """The scene with the command's own classification."""
    return replace(scene, classification="slab")


def _files(folder: Path, scene: Scene) -> Iterator[str]:
    """The scene as words of a command line: files in the folder, and the camera."""
    camera, points = scene.completed(SIZE).camera, scene.transfer_function
    assert points is not None
    np.save(folder / "values.npy", scene.volume.values)
    (folder / "function.json").write_text(json.dumps(points.as_json()))
    yield from (str(folder / "values.npy"), "--tf", str(folder / "function.json"))
    for name, triple in (("eye", camera.eye), ("target", camera.target), ("up", camera.up)):
        yield f"--{name}={','.join(map(repr, map(float, triple)))}"
    yield f"--height={camera.height!r}"
