"""Annotation that keeps apart: lines of the box from texts and legends, what shows from the legend."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.annotated import DIRECTIONS, EVERYTHING, blank, crooked

from texvol.annotation import Annotation, annotate, with_room
from texvol.annotation.drawing import place_all
from texvol.annotation.sheet import Rect
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.framing import ViewChoice, framed
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

RAS = "right-anterior-superior"
BOTH = ("orthographic", "perspective")
ALL = Annotation(orientation=True, **EVERYTHING)  # type: ignore[arg-type]


def crosses(start: Any, end: Any, rect: Rect) -> bool:
    """True if one of many points of a line lies in a rectangle."""
    points = np.linspace(np.asarray(start, float), np.asarray(end, float), 5000)
    x, y = points.T
    return bool(((x > rect.left) & (x < rect.right) & (y > rect.top) & (y < rect.bottom)).any())


@settings(max_examples=15, deadline=None)
@given(
    st.tuples(st.integers(60, 450), st.integers(60, 350)),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).filter(lambda eye: max(map(abs, eye)) > 0.1),
    st.sampled_from(sorted(DIRECTIONS)),
    st.sampled_from(BOTH),
    st.floats(0.3, 4),
)
def test_edges_of_the_box_are_left_out_where_words_and_legends_stand(
    size: tuple[int, int], position: tuple[float, ...], direction: str, projection: Projection, away: float
) -> None:
    volume = crooked(direction, RAS)
    eye = volume.centre + away * volume.radius * np.array(position)
    camera = Camera.framing(volume, projection, eye=eye, up=(0.123, 0.0456, 1))
    scene = Scene(volume, camera=camera, classification="slab")
    sheet, view = blank(scene, size)
    lines: list[tuple[Any, Any]] = []
    draw = sheet.line

    def kept(start: Any, end: Any, layer: str = "line", opacity: float = 1.0) -> None:
        if layer in ("box", "behind"):
            lines.append((start, end))
        draw(start, end, layer, opacity)

    sheet.line = kept  # type: ignore[method-assign]
    place_all(sheet, view, scene, ALL, None)
    assert not [rect for rect in sheet.written for line in lines if crosses(*line, rect)]


def test_an_edge_goes_on_beside_a_word() -> None:
    """A line at a title is left out over the title's width, and nowhere else."""
    volume = Volume(np.zeros((8, 8, 8)))
    camera = Camera.framing(volume, eye=volume.centre - (0, 30, 0), up=(0, 0, 1))
    scene = Scene(volume, camera=camera, classification="slab")
    size = (300, 300)
    sheet, view = blank(scene, size)
    sheet.taken.append(Rect(100, 0, 200, 60))
    place_all(sheet, view, scene, Annotation(box=True), None)
    row = sheet.over(np.zeros((300, 300, 4)), (0, 0, 0))[:40, :, 0].max(axis=0) > 0
    assert not row[100:200].any()
    assert row[15:95].all() and row[205:285].all()


def engine(projection: Projection) -> Scene:
    """A block that nearly fills a wide box, whose values are seen from the front, one side and above."""
    values = np.zeros((40, 80, 80), np.float32)
    values[4:36, 6:74, 6:74] = np.linspace(50, 255, 68)
    volume = Volume(values, spacing=(1, 1, 1), space=RAS, unit="mm")
    medium = Scene(volume, "ct-bone", lighting="none").looked.transfer_function
    camera = framed(Scene(volume, medium), projection, choice=ViewChoice("iso"))
    return Scene(volume, medium, camera, classification="slab")


@pytest.mark.parametrize("projection", BOTH)
@pytest.mark.parametrize("size", [(512, 512), (400, 400), (640, 400)])
def test_with_everything_on_what_shows_fills_seven_tenths_and_keeps_clear_of_the_legend(
    projection: Projection, size: tuple[int, int]
) -> None:
    scene = engine(projection)
    camera = with_room(scene.completed(size).camera, scene, size, ALL)
    scene = Scene(scene.volume, scene.transfer_function, camera, classification="slab")
    with Renderer() as renderer:
        picture = renderer.render(scene, size)
    columns, rows = (np.flatnonzero(picture[..., 3].max(axis=axis) > 0.5) for axis in (0, 1))
    widest = max(np.ptp(columns) + 1, np.ptp(rows) + 1)
    sheet, view = blank(scene, size)
    place_all(sheet, view, scene, ALL, None)
    legend = min(rect.left for rect, text in zip(sheet.written, sheet.texts, strict=True) if text == "opacity of")
    assert widest >= 0.69 * min(size)  # 0.70 of 99 % of what shows
    assert columns.min() > 0 and columns.max() < legend
    assert annotate(picture, scene, size, ALL).shape == picture.shape
