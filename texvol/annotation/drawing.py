"""Drawing of all parts of annotation: parts with a fixed position first, then axes, which can give way.

The lines of box and axes come last: they are left out where other parts stand.
"""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import NDArray

from texvol.annotation.axes import axis_name, draw_axes, laid_axes
from texvol.annotation.legend import draw_legends
from texvol.annotation.legend_content import contents_of
from texvol.annotation.lettering import Lettering, one_line
from texvol.annotation.measures import color_on, draw_measures, text_of
from texvol.annotation.orientation import check_space, draw_orientation
from texvol.annotation.request import Annotation
from texvol.annotation.scale_bar import draw_scale_bar
from texvol.annotation.sheet import WHITE, Sheet
from texvol.annotation.view import EDGES, View
from texvol.scene.scene import Scene

_TITLE, _SMALLEST_TITLE = 1.25, 0.7  # size in ems; the fraction of it to which a title is shrunk before it is cut
_TITLE_FROM_BORDER = 0.6  # ems
Legends = Callable[[Sheet, Scene, Annotation, "tuple[float, float] | None"], None]
# Opacities of the box's edges, less than that of text and ticks; hidden ones are fainter, as in technical drawings.
_SEEN, _HIDDEN = 0.8, 0.5


def check_drawable(annotation: Annotation, scene: Scene) -> Lettering:
    """Return the lettering of an annotation; raise errors as `annotation.check` does."""
    if annotation.orientation:
        check_space(scene.volume)
    letters = Lettering(annotation.font)
    letters.check(annotation.title or "", "title")
    letters.check(annotation.value_name, "name of the values")
    if annotation.axes:
        for axis in range(3):
            letters.check(axis_name(scene.volume, axis, "×10⁻⁹"), f"{scene.volume.name}: name of an axis")
    for measure in annotation.measures:
        letters.check(text_of(measure, scene.volume.unit), "measure")
    if annotation.scale_bar:
        letters.check(scene.volume.unit, f"{scene.volume.name}: unit")
    return letters


def annotated(
    picture: NDArray, scene: Scene, annotation: Annotation, transparent: bool, window: tuple[float, float] | None
) -> NDArray:
    """Return the picture with its annotation; see `annotate`."""
    letters = check_drawable(annotation, scene)
    size = picture.shape[1], picture.shape[0]
    # A transparent picture is drawn for a white page.
    sheet = Sheet(size, letters, WHITE if transparent else scene.background, annotation.color, annotation.font_size)
    view = View(scene.completed(size).camera, scene.box, size)
    place_all(sheet, view, scene, annotation, window)
    return sheet.over(picture, scene.background)


def place_all(
    sheet: Sheet,
    view: View,
    scene: Scene,
    annotation: Annotation,
    window: tuple[float, float] | None,
    legends: Legends | None = None,
) -> None:
    """Draw the parts of an annotation that have room on a sheet; `legends` is used in place of `place_legends`."""
    if annotation.title:
        _draw_title(sheet, one_line(annotation.title))
    if annotation.orientation:
        draw_orientation(sheet, view)
    if annotation.legend:
        (legends or place_legends)(sheet, scene, annotation, window)
    if annotation.scale_bar:
        draw_scale_bar(sheet, view)
    if annotation.measures:
        color = color_on(sheet.outline_color) if annotation.color is None else annotation.color
        draw_measures(sheet, view, annotation.measures, color)
    axes = laid_axes(sheet, view) if annotation.axes else []
    if annotation.box:
        for volume in scene.volumes:
            _draw_box(sheet, View(view.camera, volume, view.size))
    draw_axes(sheet, view, axes)


def place_legends(sheet: Sheet, scene: Scene, annotation: Annotation, window: tuple[float, float] | None) -> None:
    """Draw the legends that have room on a sheet."""
    contents = contents_of(scene, annotation.value_name, window, sheet.letters)
    for content in contents:
        for text in content.texts:
            sheet.letters.check(text, "legend")
    draw_legends(sheet, contents, beside_letters=annotation.orientation)


def _draw_box(sheet: Sheet, view: View) -> None:
    """Draw the visible edges of a box: near edges cover the medium, far edges are seen through it."""
    for edge in EDGES:
        ends = view.edge(edge)
        if ends is not None:
            hidden = view.faces_that_show(edge) == 0
            sheet.broken_line(*ends, "behind" if hidden else "box", opacity=_HIDDEN if hidden else _SEEN)


def _draw_title(sheet: Sheet, title: str) -> None:
    """Draw the title at the top centre, as large as it fits."""
    off = _TITLE_FROM_BORDER * sheet.em
    text, size = sheet.letters.fitted(title, _TITLE * sheet.em, sheet.size[0] - 2 * off, _SMALLEST_TITLE)
    if not text:
        return
    scale = size / sheet.em
    middle = sheet.size[0] / 2, off + sheet.text_size(text, scale)[1] / 2
    rect = sheet.text_rect(text, middle, scale)
    if sheet.fits(rect):
        sheet.taken.append(rect)
        sheet.text(text, middle, scale)
