"""Figures of the page on the survey's methods: its Figures 6.7 and 6.13 again, with an axis of error."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import texvol
from texvol import Camera, Renderer, Scene
from texvol.formats.pictures.page_pictures import colored, png
from texvol.methods import METHODS, Method, draw, method_of
from texvol.ray_casting import raycast
from texvol.scene import orbit

Figure = tuple[str, Image.Image]  # name of the file, picture
Drawn = tuple[NDArray, float]  # picture, and its seconds
_SIZE = (256, 256)
_LEAST, _MOST = -4.0, 0.0  # powers of ten at the ends of the scale of error pictures
_WALKS = ("bresenham", "tripod", "bresenham-true", "tripod-true")
_INKS = {
    "bresenham": "#d5553a", "tripod": "#56a0e4", "bresenham-true": "#e69f00", "tripod-true": "#009e73",
    "shear-warp": "#d5553a", "ray casting": "#009e73", "texvol slab": "#e69f00", "texvol slices": "#e69f00",
    "wavelets": "#56a0e4", "dct": "#b978c2",
}  # fmt: skip
_RATES = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
_TURNS = 7  # pictures of which the median time is taken


def draw_methods(folder: Path) -> Iterator[Figure]:
    """The figures of `methods.md`, of the example volumes in a folder."""
    chest = _scene(folder / "chest.nrrd", "ct-bone", (-300, -900, 200))
    cloud = Scene(texvol.load(folder / "cloud.npy"), "fog", classification="extinction")
    yield "methods-walks.png", _of_walks(chest, cloud)
    yield "methods-shear-warp.png", _of_shear_warp(chest)
    yield "methods-bits.png", _of_bits(chest)


def _scene(path: Path, preset: str, eye: tuple[float, float, float]) -> Scene:
    volume = texvol.load(path)
    return Scene(volume, preset, Camera.framing(volume, eye=eye), classification="extinction")


def _of_walks(scene: Scene, thin: Scene) -> Image.Image:
    """Figure 6.7: pictures by Bresenham and tripod with their errors, and that of a thin medium as the view turns."""
    figure, axes = _laid_out(len(_WALKS))
    truth = raycast(scene, _SIZE)
    for name, column in zip(_WALKS, axes[1], strict=True):
        _show(column, name, draw(name, scene, _SIZE), truth)
    panel = axes[0]
    angles = np.arange(0, 91, 7.5)
    camera = thin.completed(_SIZE).camera
    side = replace(camera, eye=tuple(np.array(camera.target) - (0, camera.target_distance, 0)), up=(0, 0, 1))
    for name in _WALKS:
        errors = []
        for angle in angles:
            view = replace(thin, camera=orbit.turned(side, float(angle)))
            errors.append(_rms(draw(name, view, (128, 128)), raycast(view, (128, 128))))
        panel.plot(angles, errors, "o-", color=_INKS[name], markersize=4, label=name)
    panel.set(
        yscale="log", xlabel="angle of the view from the axis y, degrees", ylabel="rms error", xticks=range(0, 91, 15)
    )
    panel.set_title("A cloud: length 1 for each voxel, and true lengths")
    return _picture(figure, panel)


def _of_shear_warp(scene: Scene) -> Image.Image:
    """Figure 6.13: shear-warp and ray casting with their errors, and time against error."""
    names = [each for each in ("shear-warp", "equal-steps-before") if each in METHODS]
    figure, axes = _laid_out(len(names))
    truth = raycast(scene, _SIZE)
    for name, column in zip(names, axes[1], strict=True):
        _show(column, name, draw(name, scene, _SIZE), truth)
    panel, complete = axes[0], scene.completed(_SIZE)
    sliced = replace(scene, classification="slab")
    cast = [method_of("equal-steps-before")(complete, sampling_rate=rate) for rate in _RATES]  # type: ignore[call-arg]
    with Renderer() as renderer:
        ways: dict[str, list[Callable[[], Drawn]]] = {
            "texvol slab": [lambda rate=rate: _sliced(renderer, sliced, rate) for rate in _RATES],
            "ray casting": [lambda each=each: _timed(each, complete) for each in cast],
        }
        if "shear-warp" in names:
            warped = method_of("shear-warp")(complete)
            ways["shear-warp"] = [lambda: _timed(warped, complete)]
        _curves(panel, ways, truth)
    panel.set(xscale="log", yscale="log", xlabel="milliseconds of a picture", ylabel="rms error")
    panel.set_title("The source: 1.2 s and 13.8 s, and no error")
    return _picture(figure, panel)


def _of_bits(scene: Scene) -> Image.Image:
    """Error of compressed volumes against their size."""
    figure, axes = _laid_out(2)
    scene = replace(scene, classification="post")
    truth, complete = raycast(scene, _SIZE), scene.completed(_SIZE)
    for name, column in zip(("wavelets", "dct"), axes[1], strict=True):
        _show(column, f"{name}, 0.02 kept", draw(name, scene, _SIZE, kept=0.02), truth)
        points = []
        for kept in (1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001):
            method: Any = method_of(name)(complete, kept=kept)  # type: ignore[call-arg]
            points.append((method.bits_per_voxel, _rms(method.picture(complete.camera, _SIZE), truth)))
        axes[0].plot(*zip(*points, strict=True), "o-", color=_INKS[name], markersize=4, label=name)
    axes[0].set(xscale="log", yscale="log", xlabel="bits per voxel", ylabel="rms error")
    axes[0].set_title("Coefficients that are kept")
    return _picture(figure, axes[0])


def _timed(method: Method, complete: Any) -> Drawn:
    """Return a picture by a method that is prepared, and the seconds that it took."""
    start = time.perf_counter()
    picture = method.picture(complete.camera, _SIZE)
    return picture, time.perf_counter() - start


def _sliced(renderer: Renderer, scene: Scene, rate: float) -> Drawn:
    """Return a picture by slices, and the seconds of its frame, without those of its texture."""
    picture = renderer.render(scene, _SIZE, sampling_rate=rate)
    return picture, renderer.seconds["draw"] + renderer.seconds["read"]


def _curves(panel: Any, ways: dict[str, list[Callable[[], Drawn]]], truth: NDArray) -> None:
    """Plot median milliseconds and rms error of all ways to draw; all have one turn before any has its next."""
    seconds: dict[tuple[str, int], list[float]] = {}
    errors: dict[tuple[str, int], float] = {}
    for turn in range(_TURNS + 1):
        for name, each in ways.items():
            for number, way in enumerate(each):
                picture, taken = way()
                errors[name, number] = _rms(picture, truth)
                if turn:  # the first is not warm
                    seconds.setdefault((name, number), []).append(taken)
    for name, each in ways.items():
        keys = [(name, number) for number in range(len(each))]
        points = [(1e3 * float(np.median(seconds[key])), errors[key]) for key in keys]
        print(f"  {name}:", *(f"{milliseconds:.1f} ms {error:.1e}," for milliseconds, error in points))
        panel.plot(*zip(*points, strict=True), "o-", color=_INKS[name], markersize=5, label=name)


def _rms(picture: NDArray, truth: NDArray) -> float:
    return float(np.sqrt(np.square(picture - truth).mean()))


def _laid_out(pairs: int) -> tuple[Any, tuple[Any, list[tuple[Any, Any]]]]:
    """A figure with a plot on the left, and columns of a picture above its errors on the right."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(5 + 2 * pairs, 4.2), dpi=110, layout="constrained")
    grid = figure.add_gridspec(2, 1 + pairs, width_ratios=[4.5, *[2] * pairs])
    plot = figure.add_subplot(grid[:, 0])
    plot.grid(True, which="both", linewidth=0.3)
    columns = [(figure.add_subplot(grid[0, 1 + i]), figure.add_subplot(grid[1, 1 + i])) for i in range(pairs)]
    return figure, (plot, columns)


def _show(column: tuple[Any, Any], name: str, picture: NDArray, truth: NDArray) -> None:
    """Show a picture over black, and its errors below it."""
    errors = np.abs(picture - truth).max(axis=-1)
    fractions = np.clip((np.log10(np.maximum(errors, 1e-30)) - _LEAST) / (_MOST - _LEAST), 0, 1)
    for axes, pixels in zip(column, (picture, colored(fractions)), strict=True):
        axes.imshow(Image.open(BytesIO(png(pixels))))
        axes.set_axis_off()
    column[0].set_title(name, fontsize=9)
    column[1].set_title(f"rms {_rms(picture, truth):.1e}", fontsize=9)


def _picture(figure: Any, panel: Any) -> Image.Image:
    from matplotlib import pyplot as plt

    panel.legend(fontsize=8)
    file = BytesIO()
    figure.savefig(file, format="png")
    plt.close(figure)
    return Image.open(file).convert("RGB").quantize(128)
