"""Figures of the documentation that no command of a page draws: presets, slabs, layers, the window."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from texvol import Camera, Volume
from texvol.__main__ import main as texvol_main
from texvol.opengl.wilson import sections
from texvol.scene.transfer import PRESETS
from texvol.slicing.slabs import BOX_EDGES, box_corners

Figure = tuple[str, Image.Image]  # name of the file, picture
THUMBNAIL = 200
_SIDE = "--eye -300,-900,200"
_BEHIND = "--eye -300,400,260 --height 150"
# Volume and options by the preset's name; CT of the others.
_SHOWN = {
    "mr": f"brain.nrrd {_BEHIND}", "mr-materials": f"brain.nrrd {_BEHIND}", "solid": "knot.npy", "fog": "cloud.npy",
    "grey": "cloud.npy", "viridis": "knot.npy", "inferno": "knot.npy", "magma": "knot.npy", "cividis": "knot.npy",
    "diverging": "gyroid.npy", "fluorescence": "cell.tif --channel 0",
    "histogram": f"brain.nrrd {_BEHIND}", "contours": f"brain.nrrd {_BEHIND}", "boundaries": f"brain.nrrd {_BEHIND}",
}  # fmt: skip


def draw_thumbnails(folder: Path) -> Iterator[Figure]:
    """One small picture of each preset, averaged from twice its size."""
    for name in PRESETS:
        volume, *view = _SHOWN.get(name, f"chest.nrrd {_SIDE}").split()
        size = f"{2 * THUMBNAIL}x{2 * THUMBNAIL}"
        post = ["--classification", "post"]
        if texvol_main(["render", volume, *view, "--tf", name, *post, "--size", size, "-o", "preset.png"]):
            raise SystemExit(f"preset {name} was not drawn")
        picture = Image.open(folder / "preset.png").resize((THUMBNAIL, THUMBNAIL), Image.Resampling.LANCZOS)
        yield f"preset-{name}.jpg", picture


def draw_slabs(folder: Path) -> Iterator[Figure]:
    """The box, its slabs across the view, and two rays of a perspective camera with their paths through one slab."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.2, 3.6), dpi=120)
    box = np.array([(4.0, -1.7), (7.6, -2.3), (8.3, 1.3), (4.7, 1.9)])
    planes = np.arange(4.0, 8.6, 0.5)
    _draw_planes(axes, box, planes)
    _draw_rays(axes, box, planes[3:5])
    axes.text(0.05, -0.5, "eye", fontsize=10)
    axes.annotate("one slab", (5.75, 2.02), (5.2, 2.75), fontsize=10, arrowprops={"arrowstyle": "-", "lw": 0.8})
    axes.annotate(
        "path of this ray\nthrough the slab", (5.78, 0.66), (1.2, 2.0), fontsize=10,
        arrowprops={"arrowstyle": "-", "lw": 0.8},
    )  # fmt: skip
    axes.annotate("last slab, cut by the box", (8.15, 0.9), (8.5, 2.2), fontsize=10,
                  arrowprops={"arrowstyle": "-", "lw": 0.8})  # fmt: skip
    axes.annotate("box of the volume", (7.0, -2.2), (8.3, -2.7), fontsize=10, arrowprops={"arrowstyle": "-", "lw": 0.8})
    axes.set(xlim=(-0.3, 10.6), ylim=(-3, 3), aspect="equal")
    axes.axis("off")
    figure.savefig(folder / "slabs.png", bbox_inches="tight", facecolor="white")
    plt.close(figure)
    yield "slabs.png", Image.open(folder / "slabs.png").convert("P", palette=Image.Palette.ADAPTIVE, colors=64)


def draw_slicing(folder: Path) -> Iterator[Figure]:
    """A cube and the polygons of some slabs; and time and error of all ways of slicing, from the table of the page."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, (cube, fog, bone) = plt.subplots(
        1, 3, figsize=(12, 3.7), dpi=120, width_ratios=(1.05, 1, 1), layout="constrained"
    )
    _draw_sections(cube)
    for axes, scene in ((fog, "256³ fog"), (bone, "256³ bone")):
        _draw_speed(axes, scene)
    fog.set_ylabel("rms error")
    figure.legend(*bone.get_legend_handles_labels(), loc="outside right center", frameon=False, fontsize=9)
    figure.savefig(folder / "slicing.png", facecolor="white")
    plt.close(figure)
    yield "slicing.png", Image.open(folder / "slicing.png").convert("P", palette=Image.Palette.ADAPTIVE, colors=128)


def _draw_sections(axes: Any) -> None:
    """The sections of a cube by the planes in the middle of nine slabs, seen from the side."""
    from matplotlib.patches import Polygon

    volume = Volume(np.zeros((2, 2, 2), np.uint8))
    camera = Camera.orthographic(volume.centre - (6.0, 3.5, 2.6), volume.centre, (0, 0, 1), 4)
    corners = box_corners(volume, camera)
    depths = np.linspace(corners[:, 2].min(), corners[:, 2].max(), 8)
    _, polygons = sections(corners, (depths[:-1] + depths[1:]) / 2)
    # Depth goes to the right, and a little of the other axes shows.
    seen = np.array([[0.3, -0.3], [0.0, 0.9], [1.5, 0.1]])
    for number, polygon in enumerate(polygons[::-1]):
        color = ("#f4b183", "#bcd3ea")[number % 2]
        axes.add_patch(Polygon(polygon[:, :3] @ seen, fc=color, ec="#333333", lw=0.8, alpha=0.8))
    for a, b in BOX_EDGES:
        axes.plot(*(corners[[a, b], :3] @ seen).T, color="#777777", lw=0.8, zorder=0)
    axes.annotate(
        "one polygon a slab,\n3 to 6 corners", (0.5, -0.12), xycoords="axes fraction", ha="center", fontsize=9
    )
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.axis("off")


def _draw_speed(axes: Any, scene: str) -> None:
    """Time and error of a scene in the table of how-it-works.md; a mark for each rate."""
    page = (Path(__file__).parents[1] / "texvol" / "docs" / "how-it-works.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.split("|")[2:-1]] for line in page.splitlines() if f"| {scene} |" in line]
    numbers = np.array(rows, float)
    for name, time_column, error_column, color, mark in (
        ("stacks", 1, 4, "#0072b2", "o"), ("polygons", 2, 4, "#e69f00", "s"), ("wilson", 3, 5, "#c0392b", "^"),
        ("stacks, 8 bits", 1, 6, "#0072b2", "."), ("polygons, 8 bits", 2, 7, "#e69f00", "."),
    ):  # fmt: skip
        line = ":" if "bits" in name else "-"
        axes.loglog(numbers[:, time_column], numbers[:, error_column], line, marker=mark, color=color, ms=5, label=name)
    axes.set(title=f"{scene}, ¼ to 8 slabs per voxel", xlabel="ms")
    axes.title.set_fontsize(10)
    axes.grid(True, which="major", lw=0.4)


def _draw_planes(axes: object, box: np.ndarray, planes: np.ndarray) -> None:
    """Slabs as bands of alternating colour inside the box, and its outline."""
    from matplotlib.patches import Polygon

    outline = Polygon(box, closed=True, fill=False, lw=1.6, ec="#333333", zorder=3)
    axes.add_patch(outline)  # type: ignore[attr-defined]
    for number, (near, far) in enumerate(pairwise(planes)):
        color = "#f4b183" if number == 3 else ("#dbe7f3", "#bcd3ea")[number % 2]
        band = Polygon([(near, -3), (far, -3), (far, 3), (near, 3)], closed=True, color=color, lw=0, zorder=1)
        axes.add_patch(band)  # type: ignore[attr-defined]
        band.set_clip_path(outline)
    for plane in planes:
        axes.plot([plane, plane], [-2.55, 2.25], color="#7a94ad", lw=0.7, ls=(0, (4, 3)), zorder=2)  # type: ignore


def _draw_rays(axes: object, box: np.ndarray, slab: np.ndarray) -> None:
    """Rays from the eye through pixel centres; the path of each through the slab is thick."""
    axes.plot([0.2], [0], "o", color="#333333", ms=5)  # type: ignore[attr-defined]
    for slope in (-0.24, -0.08, 0.1, 0.19):
        axes.plot([0.2, 9.6], [0, 9.4 * slope], color="#555555", lw=0.9, zorder=4)  # type: ignore[attr-defined]
        x = slab - 0.2
        if -2.0 < x[0] * slope < 1.7:
            axes.plot(slab, x * slope, color="#c00000", lw=3, zorder=5, solid_capstyle="butt")  # type: ignore


# Packages of a layer have one colour; layers from the top, by the first package of each.
_LAYERS = {
    "cli": "#f6d5b8", "report": "#f3e6b3", "options": "#d9ead3", "rendering": "#f4b183", "ray_casting": "#d5c6e8",
    "opengl": "#bcd3ea", "geometry": "#e3e3e3",
}  # fmt: skip


def draw_layers(folder: Path) -> Iterator[Figure]:
    """The packages of how-it-works.md, one above the other; a package imports only those below it."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.patches import Rectangle

    page = (Path(__file__).parents[1] / "texvol" / "docs" / "how-it-works.md").read_text(encoding="utf-8")
    lines = page.partition("```text\n")[2].partition("```")[0].splitlines()
    figure, axes = plt.subplots(figsize=(6.4, 0.3 * len(lines)), dpi=120)
    color = "#ffffff"
    for number, line in enumerate(lines):
        name, _, text = line.strip().partition(" ")
        color = _LAYERS.get(name, color)
        axes.add_patch(Rectangle((0, -number - 0.92), 10, 0.84, fc=color, ec="#666666", lw=0.8))
        axes.text(0.15, -number - 0.5, name, va="center", fontsize=10, weight="bold", family="monospace")
        axes.text(3.0, -number - 0.5, text.strip(), va="center", fontsize=9)
    arrow = {"arrowstyle": "-|>", "lw": 1.6, "color": "#444444"}
    axes.annotate("", (10.45, -len(lines)), (10.45, 0), arrowprops=arrow)
    axes.text(10.62, -len(lines) / 2, "imports", rotation=270, va="center", fontsize=10)
    axes.set(xlim=(-0.05, 11.2), ylim=(-len(lines) - 0.1, 0.1))
    axes.axis("off")
    figure.savefig(folder / "layers.png", bbox_inches="tight", facecolor="white")
    plt.close(figure)
    yield "layers.png", Image.open(folder / "layers.png").convert("P", palette=Image.Palette.ADAPTIVE, colors=64)


def draw_window(folder: Path) -> Iterator[Figure]:
    """The window on the chest, on a display without a screen; nothing where there is no Xvfb."""
    if shutil.which("Xvfb") is None:
        print("  no Xvfb: the picture of the window stays as it is")
        return
    display = ":97"
    server = subprocess.Popen(["Xvfb", display, "-screen", "0", "1400x900x24"], stderr=subprocess.DEVNULL)
    try:
        time.sleep(1)
        line = "view chest.nrrd --tf ct-bone --light head --eye -300,-900,200 --size 560x560 --frames 30"
        line += " --screenshot window.png"
        environment = os.environ | {"DISPLAY": display, "HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
        subprocess.run([sys.executable, "-m", "texvol", *line.split()], env=environment, check=True, timeout=300)
    finally:
        server.terminate()
        server.wait()
    yield "window.jpg", Image.open(folder / "window.png")
