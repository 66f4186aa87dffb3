"""Transfer functions of label volumes: each label has a colour and an opacity of its own, with steps between them.

A label has the colour of the volume's table, if that has one (see `label_names`). Else the colour of label k is number
k - 1 of an established list, which starts again at its end: whatever other labels there are, it keeps its colour. The
list is Glasbey's (Glasbey, van der Heijden, Toh, Gray 2007), made so that its colours lie as far apart as they can.
Label 0 is what has no label, and transparent unless told.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.label_counts import label_counts, listed
from texvol.scene.label_names import names_of, table_of
from texvol.scene.optics import depth_from_opacity
from texvol.scene.transfer.function import TransferFunction
from texvol.scene.transfer.pieces import Numbers
from texvol.scene.volume import Volume
from texvol.util.color import color_guess, color_of_text, linear_from_srgb
from texvol.util.errors import InputError

Color = tuple[float, float, float]

COLOR_LIST = "glasbey"
OPACITY = 0.3  # soft at the surface; a body of 10 samples is opaque to 97 %
_UNLABELLED = 0
# Of white's luminance. Of Glasbey's colours those are left out that light and shadow, or a black background, make one
# with black, and those that are white.
_DARKEST, _BRIGHTEST = 0.1, 0.9
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear red, green and blue (ITU-R BT.709)
_MOST_NAMES = 64  # of labels that a legend might name; of more it could say nothing


class LabelLook(NamedTuple):
    """Opacities and linear colours of labels, and the opacity of all other labels."""

    opacities: dict[int, float]
    colors: dict[int, Color]
    others: float | None = None


def label_function(
    volume: Volume,
    opacities: Mapping[int, float] | None = None,
    colors: str | Mapping[int, Color] = COLOR_LIST,
    *,
    others: float | None = None,
) -> TransferFunction:
    """A colour and an opacity for each label of a volume.

    Parameters
    ----------
    volume : Volume
        Of labels.
    opacities : mapping, optional
        Of labels, from 0 to 1, over a length of one smallest spacing of the volume; 1 is opaque at any thickness. Those
        without look solid, but for a soft edge, and 0 is transparent.
    colors : str or mapping
        A list of colours by its name in the library of colour maps, such as "tab20"; or the colours of some labels,
        linear RGB in [0, 1]. Other labels have those of the volume's table, or else of the established list. A label
        that the table hides is transparent unless it is named here, in `opacities` or by `others`.
    others : float, optional
        Opacity of the labels that neither names, but for 0.

    Raises
    ------
    InputError
        If the volume is not of labels, or has not those; if an opacity or a colour is out of range, or there is no such
        list.
    """
    labels = label_counts(volume).labels
    rows = {label: row for row, label in enumerate(labels.tolist())}
    named = {} if isinstance(colors, str) else colors
    opacities = {} if opacities is None else opacities
    unknown = [label for label in (*opacities, *named) if label not in rows]
    if unknown:
        raise InputError(f"label {unknown[0]} not found: {volume.name} has {listed(labels)}")
    established = color_list(colors if isinstance(colors, str) else COLOR_LIST)
    shown = established[(labels - 1) % len(established)]
    fractions = np.full(len(labels), OPACITY)
    if colors == COLOR_LIST or not isinstance(colors, str):
        _by_table(volume, rows, shown, fractions)
    if others is not None:
        fractions[~np.isin(labels, list(named))] = _opacity(others, "of all other labels")
    if _UNLABELLED in rows:
        fractions[rows[_UNLABELLED]] = 0.0
    for label, color in named.items():
        shown[rows[label]] = _color(color, label)
        fractions[rows[label]] = fractions[rows[label]] or (OPACITY if label != _UNLABELLED else 0.0)
    for label, opacity in opacities.items():
        fractions[rows[label]] = _opacity(opacity, f"of label {label}")
    extinctions = depth_from_opacity(fractions) / volume.smallest_spacing
    return _stepped(volume, labels, shown, extinctions)


def _by_table(volume: Volume, rows: Mapping[int, int], colors: Numbers, opacities: Numbers) -> None:
    """Set the colours that the volume's table has, and the opacity 0 of labels that it hides."""
    table = table_of(volume)
    if table is None:
        return
    for label, row in rows.items():
        entry = table.entries.get(label)
        if entry is not None and entry.color is not None:
            colors[row] = entry.color
        if entry is not None and not entry.shown:
            opacities[row] = 0.0


def _stepped(volume: Volume, labels: NDArray[np.int64], colors: Numbers, extinctions: Numbers) -> TransferFunction:
    """Steps half-way between the labels, each at a value that single precision has and tells from both.

    From 2^23 on it has whole numbers only: there a step lies at the upper label, to which its right side belongs.
    """
    middles = (labels[:-1] + labels[1:]) / 2
    steps = np.where(middles.astype(np.float32) > labels[:-1], middles, labels[1:])
    count = len(labels)
    values = np.repeat(steps, 2) if count > 1 else labels.astype(np.float64)
    rows = np.repeat(np.arange(count), 2)[1:-1] if count > 1 else np.zeros(1, np.intp)
    visible = np.flatnonzero(extinctions > 0)
    visible = visible[:0] if visible.size > _MOST_NAMES else visible
    known = names_of(volume, labels[visible].tolist())
    return TransferFunction(
        values,
        colors[rows],
        extinctions[rows],
        name=f"labels of {volume.name}",
        materials=tuple(known.get(label) or f"label {label}" for label in labels[visible].tolist()),
        material_colors=tuple((float(r), float(g), float(b)) for r, g, b in colors[visible]),
    )


def color_list(name: str = COLOR_LIST) -> Numbers:
    """The colours of a list, linear, shape (n, 3), in its order; of the established one those neither dark nor white.

    Raises
    ------
    InputError
        If there is no such list, or it is a ramp.
    """
    from cmap import Colormap

    try:
        found = Colormap(name)
    except (ValueError, TypeError):
        raise InputError(
            f"list of colours {name!r} not found; known are {COLOR_LIST}, tab20 and Set1 among others"
        ) from None
    if found.interpolation != "nearest":
        raise InputError(f"{name} must be a list of colours, got a ramp: take {COLOR_LIST}, tab20, Set1 …")
    colors = linear_from_srgb(np.asarray(found.color_stops.color_array, np.float64)[:, :3])
    if name != COLOR_LIST:
        return colors
    luminances = colors @ _LUMINANCE
    return colors[(luminances >= _DARKEST) & (luminances <= _BRIGHTEST)]


def parse_labels(text: str) -> LabelLook:
    """Parse LABEL=OPACITY, LABEL=#RRGGBB, LABEL=#RRGGBB:OPACITY and *=OPACITY, separated by commas.

    Colours are sRGB, as everywhere where they are written so; `*` stands for all labels that are not named but 0.

    Raises
    ------
    InputError
        If it is no such text, or a label stands in it twice.
    """
    look = LabelLook({}, {})
    seen: set[str] = set()
    for part in text.split(","):
        found = _PART.fullmatch(part)
        if not found or (found["label"] == "*" and found["color"]):
            raise InputError(f"{_FORM}, got {part.strip()!r}")
        label = found["label"] if found["label"] == "*" else str(int(found["label"]))
        if label in seen:
            raise InputError(f"label {label} must be given once, got it twice in {text!r}")
        seen.add(label)
        number = found["opacity"] or found["alone"]
        opacity = None if number is None else _opacity(float(number), f"of label {label}")
        if label == "*":
            look = look._replace(others=opacity)
            continue
        if opacity is not None:
            look.opacities[int(label)] = opacity
        if found["color"]:
            if (color := color_of_text(found["color"])) is None:
                raise InputError(f"{_FORM}, got {part.strip()!r}{color_guess(found['color'])}")
            look.colors[int(label)] = color
    return look


_FORM = "labels must be LABEL=OPACITY, LABEL=COLOR, LABEL=COLOR:OPACITY or *=OPACITY, separated by commas; a colour is "
_FORM += "#RRGGBB or a name such as white"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_PART = re.compile(
    r"\s*(?P<label>\*|[+-]?\d{1,9})\s*=\s*"
    rf"(?:(?P<color>\#[0-9a-fA-F]{{6}}|\#[0-9a-fA-F]{{3}}|[a-zA-Z]+)(?:\s*:\s*(?P<opacity>{_NUMBER}))?|(?P<alone>{_NUMBER}))\s*"
)


def _opacity(number: float, whose: str) -> float:
    if not 0 <= number <= 1:  # NaN is neither
        raise InputError(f"the opacity {whose} must be from 0 to 1, got {number:g}")
    return float(number)


def _color(color: Color, label: int) -> Numbers:
    numbers = np.array(color, np.float64)
    if numbers.shape != (3,) or not ((numbers >= 0) & (numbers <= 1)).all():
        raise InputError(f"the colour of label {label} must be three numbers from 0 to 1, got {color!r}")
    return numbers
