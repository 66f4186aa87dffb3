"""Figure of an ambiguous face, with the surfaces that the methods make of the cells to both sides of it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from texvol import Volume
from texvol.geometry import Mesh, surface_of

_SADDLES = {
    "above": 0.35,
    "below": -0.35,
}  # value at the saddle of the face, where those at the corners are ±1 and less
_COLUMNS = {
    "marching cubes": ("marching-cubes", 0),
    "tetrahedra": ("marching-tetrahedra", 0),
    "tetrahedra,\none sample on": ("marching-tetrahedra", 1),
    "cuberille": ("cuberille", 0),
    "contours": ("contours", 0),
}


def draw_ambiguous(folder: Path) -> Iterator[tuple[str, Image.Image]]:
    """An ambiguous face and the cells above and below it: for two values at the saddle of the face, by each method."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(11, 4.9), dpi=110)
    for number, (saddle, (title, (method, shift))) in enumerate(product(_SADDLES, _COLUMNS.items())):
        axes = figure.add_subplot(2, len(_COLUMNS), number + 1, projection="3d", computed_zorder=False)
        _draw(axes, _surface(_SADDLES[saddle], method, shift))
        if saddle == "above":
            axes.set_title(title, fontsize=10, y=1.02)
        if number % len(_COLUMNS) == 0:
            axes.text2D(-0.12, 0.5, f"saddle\n{saddle}", transform=axes.transAxes, fontsize=10, ha="center")
    figure.subplots_adjust(left=0.06, right=0.995, bottom=0, top=0.87, wspace=0, hspace=0)
    figure.savefig(folder / "ambiguous.png", facecolor="white")
    plt.close(figure)
    yield "ambiguous.png", Image.open(folder / "ambiguous.png").convert("P", palette=Image.Palette.ADAPTIVE, colors=64)


def _surface(saddle: float, method: str, shift: int) -> Mesh:
    """The surface at 0 around two samples across a face; `shift`: in a volume that begins one sample earlier."""
    values = np.full((3, 4, 4 + shift), -1.0)
    values[1, 1:3, 1 + shift : 3 + shift] = [[1, 2 * saddle - 1], [2 * saddle - 1, 1]]
    return surface_of(Volume(values, origin=(-1 - shift, -1, -1)), 0.0, method)  # type: ignore[call-overload, no-any-return]


def _draw(axes: Any, mesh: Mesh) -> None:
    from matplotlib.colors import LightSource
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    places = np.array(list(product((0, 1), (0, 1), (-1, 0, 1))))
    for a, b in combinations(places, 2):
        if np.abs(a - b).sum() == 1:
            on_face = a[2] == b[2] == 0
            axes.plot(*np.stack([a, b], axis=1), color="#222222" if on_face else "#999999", lw=1.6 if on_face else 0.7)
    light = LightSource(azdeg=200, altdeg=55)
    facets = Poly3DCollection(
        mesh.vertices[mesh.triangles], facecolors="#e3b27c", edgecolors="#7a5a34", lw=0.4, alpha=0.6, shade=True,
        lightsource=light,
    )  # fmt: skip
    axes.add_collection3d(facets)
    for x, y, z in places:
        color = "#b3261e" if z == 0 and x == y else "white"
        axes.scatter(x, y, z, s=24, color=color, edgecolors="#333333", lw=0.8, zorder=3, depthshade=False)
    axes.set(xlim=(-0.6, 1.6), ylim=(-0.6, 1.6), zlim=(-1.1, 1.1))
    axes.set_box_aspect((1, 1, 1), zoom=1.25)
    axes.view_init(elev=36, azim=-20)
    axes.set_axis_off()
