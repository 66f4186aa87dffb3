"""Cards that notebooks show of volumes, scenes, transfer functions and cameras: HTML without scripts.

A volume is shown by its largest values along each axis, which need no graphics card; a scene by a small picture.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import image
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.color import linear_from_srgb, srgb_from_linear
from texvol.util.errors import TexvolError
from texvol.util.statistics import histogram

_SIDE = 128  # pixels of a thumbnail
_MOST = 256  # samples along an axis that a thumbnail looks at
_BINS = 64
_STRIP = (256, 40)  # pixels of a transfer function


def card(thing: object) -> str:
    """Return the card of a volume, scene, transfer function or camera."""
    if isinstance(thing, Scene):
        return _scene(thing)
    if isinstance(thing, Volume):
        return _volume(thing)
    if isinstance(thing, TransferFunction):
        strip = _png(linear_from_srgb(_strip(thing)), f"colours of {thing.name}")
        return _box([strip], [("", escape(repr(thing)))])
    assert isinstance(thing, Camera)
    return _box([], [("", escape(repr(thing)))])


def _scene(scene: Scene) -> str:
    pictures = []
    try:
        with Renderer() as renderer:
            colors = renderer.render(scene, (2 * _SIDE, 2 * _SIDE)).to_srgb()
        pictures.append(_png(linear_from_srgb(colors / 255), "the scene"))
    except TexvolError as error:  # the card is of use without its picture
        pictures.append(f"<em>no picture: {escape(str(error))}</em>")
    medium = scene.looked.transfer_function
    rows = [("volume", escape(repr(scene.volume))), ("mode", f"{scene.mode}, {scene.classification}")]
    rows += [] if medium is None else [("transfer function", escape(repr(medium)))]
    rows += [] if scene.camera is None else [("camera", escape(repr(scene.camera)))]
    rows += [("further", escape(repr(each.volume))) for each in scene.added]
    return _box(pictures, rows)


def _volume(volume: Volume) -> str:
    seen = volume.overview
    nx, ny, nz = volume.dimensions
    edges = np.linalg.norm(volume.box_edges, axis=0)
    unit = f" {volume.unit}" if volume.unit else ""
    spacing = " x ".join(f"{each:.4g}" for each in volume.spacing)
    rows = [
        ("name", escape(volume.name)),
        ("samples", f"{nx} x {ny} x {nz} {volume.dtype}"),
        ("spacing", f"{spacing}{unit}"),
        ("size", " x ".join(f"{each:.4g}" for each in edges) + unit),
    ]
    ends = seen.finite_range
    if ends is None:
        return _box([], [*rows, ("values", "none is finite")])
    value_unit = f" {escape(volume.value_unit)}" if volume.value_unit else ""
    rows.append(("values", f"{ends[0]:.6g} … {ends[1]:.6g}{value_unit}"))
    few = seen.values[tuple(slice(None, None, -(-count // _MOST)) for count in seen.shape)].astype(np.float64)
    few = np.where(np.isfinite(few), few, ends[0])
    return _box([*_projections(few, edges, ends), _histogram(few, ends)], rows)


def _projections(values: NDArray[np.float64], edges: NDArray[np.float64], ends: tuple[float, float]) -> Iterable[str]:
    """Yield pictures of the largest values along z, y and x, in the proportions of the world."""
    grey = (values - ends[0]) / max(ends[1] - ends[0], np.finfo(np.float64).tiny)
    for axis, (right, down), word in ((0, (0, 1), "z"), (1, (0, 2), "y"), (2, (1, 2), "x")):
        seen = grey.max(axis=axis)
        seen = seen if axis == 0 else seen[::-1]  # z points up
        scale = _SIDE / max(edges[right], edges[down])
        size = [max(round(float(edges[each] * scale)), 1) for each in (down, right)]
        rows, columns = (np.arange(count) * length // count for count, length in zip(size, seen.shape, strict=True))
        yield _png(linear_from_srgb(np.repeat(seen[rows][:, columns, np.newaxis], 3, axis=2)), f"largest along {word}")


def _histogram(values: NDArray[np.float64], ends: tuple[float, float]) -> str:
    """Return the logarithmic histogram of the values, SVG."""
    counts, _ = histogram(values, _BINS, ends)
    heights = np.log1p(counts) / np.log1p(counts.max()) * 100
    bars = "".join(
        f'<rect x="{number}" y="{100 - height:.1f}" width="1" height="{height:.1f}"/>'
        for number, height in enumerate(heights)
    )
    return (
        f'<svg viewBox="0 0 {_BINS} 100" preserveAspectRatio="none" width="{_SIDE}" height="{_SIDE}" '
        f'fill="currentColor" role="img"><title>histogram, logarithmic</title>{bars}</svg>'
    )


def _strip(medium: TransferFunction) -> NDArray[np.float64]:
    """Return colours by value from left to right, as high as the extinction, sRGB of shape (height, width, 3)."""
    from texvol.scene.display import straight_colors

    width, height = _STRIP
    low, high = float(medium.values[0]), float(medium.values[-1])
    values = np.linspace(low, high, width) if low < high else np.full(width, low)
    extinction = np.nan_to_num(medium.at(values)[:, 3], posinf=np.finfo(np.float64).max)
    tall = np.sqrt(extinction / max(extinction.max(), np.finfo(np.float64).tiny))
    colors = srgb_from_linear(straight_colors(medium, values))
    under = np.linspace(1, 0, height)[:, np.newaxis] <= tall
    return np.where(under[..., np.newaxis], colors, 0.25 * colors + 0.6)


def _png(linear: NDArray[Any], about: str) -> str:
    encoded = base64.b64encode(image.encoded("card.png", np.asarray(linear, np.float32), quick=True)).decode()
    return f'<img src="data:image/png;base64,{encoded}" alt="{escape(about)}" title="{escape(about)}">'


def _box(pictures: Iterable[str], rows: Iterable[tuple[str, str]]) -> str:
    """Return pictures in a row above a table of names and texts, which are HTML."""
    lines = "".join(
        f'<tr><th style="text-align:left">{name}</th><td style="text-align:left">{text}</td></tr>'
        for name, text in rows
    )
    shown = "".join(pictures)
    row = f'<div style="display:flex;gap:4px;align-items:flex-end">{shown}</div>' if shown else ""
    return f'<div class="texvol-card">{row}<table>{lines}</table></div>'
