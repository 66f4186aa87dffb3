"""Orders of convergence, in the way of Etiene et al. (2014): by how much a picture changes as one thing gets finer.

Slabs: the slope of log rms discretisation error over log thickness, by least squares, in this scene. Grids, in a scene
of the program's own: a trilinear field on a finer grid is the same field, and its picture must not change (order 0); a
smooth field is met better by a finer grid, its picture's changes falling with order 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

if TYPE_CHECKING:
    from texvol.report.measuring import Findings

_SIZE = (96, 96)
_EDGE = 24.0  # of the box of the program's own scenes, world units
_MEDIUM = TransferFunction(np.array([0.0, 1.0]), np.array([(0.2, 0.4, 0.9), (1.0, 0.8, 0.4)]), np.array([0.0, 0.1]))


def slope(steps: Sequence[float], changes: Sequence[float]) -> float | None:
    """Least-squares slope of log change over log step; None for fewer than two changes, or where one is nothing."""
    if len(changes) < 2 or not min(changes) > 0:
        return None
    return float(np.polyfit(np.log(steps), np.log(changes), 1)[0])


def slab_orders(findings: Findings) -> dict[str, float | None]:
    """Order in the slab thickness of each classification, from the settings with automatic formats."""
    orders = {}
    for classification in CLASSIFICATIONS:
        measured = [
            (each.slab_thickness, each.discretisation.rms_error)
            for each in findings.ours
            if each.setting.classification == classification
            and (each.setting.texture_format, each.setting.target_format) == ("auto", "auto")
            and each.discretisation is not None
        ]
        orders[classification] = slope(*zip(*measured, strict=True)) if measured else None
    return orders


def trilinear_change(renderer: Renderer) -> float:
    """Largest change of a picture when a random trilinear field is sampled three times as finely: rounding."""
    coarse = np.random.default_rng(8).random((8, 8, 8))
    fine = coarse
    for axis in range(3):
        fine = np.apply_along_axis(_three_times, axis, fine)
    one, other = (_picture(renderer, values) for values in (coarse, fine))
    return float(np.abs(one - other).max())


def smooth_order(renderer: Renderer) -> float | None:
    """Order in the grid spacing of the changes between pictures of a smooth field on 12, 24, 48 and 96 samples."""
    samples = (12, 24, 48, 96)
    pictures = [_picture(renderer, _smooth(count)) for count in samples]
    changes = [float(np.sqrt(np.square(b - a).mean())) for a, b in pairwise(pictures)]
    return slope([_EDGE / count for count in samples[:-1]], changes)


def order_section(findings: Findings) -> str:
    """The section's HTML."""
    rows = [
        (f"slab thickness, {name}", expected, "–" if order is None else f"{order:.2f}")
        for (name, order), expected in zip(slab_orders(findings).items(), ("1 to 2", "2", "2", "2"), strict=True)
    ]
    if findings.grid_change is not None and findings.grid_order is not None:
        rows.append(("grid of a trilinear field", "0", f"no change (at most {findings.grid_change:.0e})"))
        rows.append(("grid of a smooth field", "2", f"{findings.grid_order:.2f}"))
    cells = (f'<td class="first">{what}</td><td>{wanted}</td><td>{measured}</td>' for what, wanted, measured in rows)
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    return f"""<h2>Orders of convergence</h2>
<p>The power of the step with which the rms error, or the change from one grid to the next, falls; slabs in this scene,
grids in one of the program's own. <code>slab</code> has order 1 on opaque matter; <code>post</code> has less than 2
where the transfer function has steps or spikes.</p>
<div class="wide"><table>
<thead><tr><th class="first">what gets finer</th><th>expected</th><th>measured</th></tr></thead>
<tbody>{body}</tbody></table></div>"""


def _picture(renderer: Renderer, values: NDArray[np.float64]) -> NDArray[np.float64]:
    spacing = _EDGE / values.shape[0]
    volume = Volume(values.astype(np.float32), (spacing,) * 3, (spacing / 2,) * 3)
    scene = Scene(volume, _MEDIUM, Camera.framing(volume), classification="post")
    options = {"texture_format": "rgba32f", "target_format": "rgba32f"}
    return renderer.render(scene, _SIZE, slab_thickness=_EDGE / 96, **options).astype(np.float64)  # type: ignore[arg-type]


def _three_times(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The piecewise linear interpolant of `values` at three times as many places, each sample among them."""
    positions = (np.arange(3 * values.size) + 0.5) / 3 - 0.5
    return np.interp(positions, np.arange(values.size), values)


def _smooth(samples: int) -> NDArray[np.float64]:
    axis = (np.arange(samples) + 0.5) / samples * 2 - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    return 0.5 + 0.5 * np.sin(3 * x + y) * np.cos(4 * y - z) * np.sin(3 * z + 1)
