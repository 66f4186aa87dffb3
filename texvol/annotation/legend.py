"""Legends: from left to right the opacity of each value, its colour, and numbers; captions above, names below.

Opacity is drawn in the medium's own colours; it grows from 0 at the colour bar to 1 at the left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from texvol.annotation import marks, rounding
from texvol.annotation.legend_content import ColorBar, Content
from texvol.annotation.lettering import one_line
from texvol.annotation.marks import Numbers
from texvol.annotation.sheet import Rect, Sheet

_SCALE, _SMALL = 0.9, 0.8
_BAR, _PLOT, _TICK, _GAP, _LINE = 1.0, 3.2, 0.3, 0.35, 1.35  # ems; _LINE is the distance of lines of text
_FROM_BORDER, _BESIDE_LETTERS = 0.6, 2.6  # ems
_HEIGHT, _LOWEST = 0.4, 5.0  # fraction of the picture's height; ems
_HIGHEST_POSITION, _LOWEST_POSITION = 0.25, 0.75  # positions besides the middle, as fractions of the free height
_CLOSEST = 2.2  # ems between numbers
_FINER = 8  # samples per row of pixels, over which colours and steps are averaged
_MOST_NAMES, _LONGEST_NAME = 12, 12.0  # the latter in ems
_MOST_LABELS, _LEAST_LABELS = 48, 6  # names in a legend without a colour bar
_BETWEEN = 1.0  # ems between two legends


@dataclass(frozen=True)
class _Legend:
    """Parts of a legend that has been laid out, and their sizes in whole pixels."""

    bar: ColorBar | None
    captions: list[str]  # lines above the bar
    numbers: list[tuple[float, str]]  # beside the bar, see `_numbers`
    entries: tuple[tuple[str, Numbers | None], ...]
    plot: int  # width of the opacities, 0 without them
    height: int  # of the bar
    above: int  # between the captions and the bar, for a number at its upper end
    below: int  # between the bar and the names, for a number at its lower end and the texts of the opacities
    width: int
    total: int  # height of all parts


def draw_legends(sheet: Sheet, contents: Sequence[Content], *, beside_letters: bool = False) -> None:
    """Draw legends below each other at the right, as many as have room.

    If room is short, first names and opacity are left out, then labels, then the last legends.
    """
    right = sheet.size[0] - (_BESIDE_LETTERS if beside_letters else _FROM_BORDER) * sheet.em
    for count in range(len(contents), 0, -1):
        for most, with_opacity, with_names in product(_numbers_of_labels(contents), (True, False), (True, False)):
            chosen = [_cut(sheet, content, most) for content in contents[:count]]
            legends = _laid(sheet, chosen, with_opacity, with_names)
            rect = _position(sheet, legends, int(right))
            if rect is not None:
                sheet.taken.append(rect)
                top = int(rect.top)
                for legend in legends:
                    _draw(sheet, legend, int(rect.left), top)
                    top += legend.total + round(_BETWEEN * sheet.em)
                return


def legends_width(sheet: Sheet, contents: Sequence[Content]) -> int:
    """Return the width in pixels of the widest legend, with all of its names or with the fewest."""
    numbers = _numbers_of_labels(contents)
    cut = [_cut(sheet, content, most) for content in contents for most in (numbers[0], numbers[-1])]
    return max((legend.width for legend in _laid(sheet, cut, True, True)), default=0)


def _numbers_of_labels(contents: Sequence[Content]) -> range:
    """Return the numbers of labels to try, from the largest on."""
    longest = max((len(content.entries) for content in contents if content.bar is None), default=0)
    return range(max(min(longest, _MOST_LABELS), _LEAST_LABELS), _LEAST_LABELS - 1, -1)


def _position(sheet: Sheet, legends: Sequence[_Legend], right: int) -> Rect | None:
    """Return the rectangle in which the legends have room, preferably in the middle; None without room."""
    width = max(legend.width for legend in legends)
    height = sum(legend.total for legend in legends) + round(_BETWEEN * sheet.em) * (len(legends) - 1)
    for fraction in (0.5, _HIGHEST_POSITION, _LOWEST_POSITION):
        top = round(fraction * (sheet.size[1] - height))
        rect = Rect(right - width, top, right, top + height)
        if sheet.fits(rect):
            return rect
    return None


def _cut(sheet: Sheet, content: Content, most_labels: int) -> Content:
    """Return the content with long texts cut, and with at most the first names."""

    def cut(text: str) -> str:
        return sheet.letters.fitted(one_line(text), _SCALE * sheet.em, _LONGEST_NAME * sheet.em, 1.0)[0]

    most = most_labels if content.bar is None else _MOST_NAMES
    names = list(content.entries)
    if len(names) > most:
        names = [*names[: most - 1], (f"and {len(names) - most + 1} more", None)]
    return replace(content, caption=cut(content.caption), entries=tuple((cut(name), color) for name, color in names))


def _laid(sheet: Sheet, contents: Sequence[Content], with_opacity: bool, with_names: bool) -> list[_Legend]:
    """Return legends that share the picture's height."""
    bars = sum(content.bar is not None for content in contents)
    height = max(round(_HEIGHT / max(bars, 1) * sheet.size[1]), round(_LOWEST * sheet.em))
    return [_laid_out(sheet, content, height, with_opacity, with_names) for content in contents]


def _laid_out(sheet: Sheet, content: Content, height: int, with_opacity: bool, with_names: bool) -> _Legend:
    em, bar = sheet.em, content.bar
    entries = content.entries if with_names or bar is None else ()
    widths = [sheet.text_size(name, _SCALE)[0] + (_LINE * em if color is not None else 0) for name, color in entries]
    widths.append(sheet.text_size(content.caption, _SCALE)[0])
    numbers: list[tuple[float, str]] = []
    factor, plot, above, below = "", 0, 0, 0
    if bar is None:
        height = 0
    else:
        numbers, factor = _numbers(sheet, bar, height)
        above, below = _beyond(numbers, height, _LINE * em)
        plot = round(_PLOT * em) if with_opacity and bar.opacities is not None else 0
        widest = max(sheet.text_size(text, _SCALE)[0] for _, text in numbers)
        widths.append(plot + round(_BAR * em) + (_TICK + _GAP) * em + widest)
        if plot:
            widths += [sheet.text_size(text, _SMALL)[0] for text in bar.opacity_of]
            below = max(below, round((1 + len(bar.opacity_of)) * _LINE * em * _SMALL))
    captions = [text for text in (content.caption, factor) if text]
    total = above + height + below + round(_LINE * em) * (len(captions) + len(entries))
    return _Legend(bar, captions, numbers, entries, plot, height, above, below, int(np.ceil(max(widths))), total)


def _beyond(numbers: Sequence[tuple[float, str]], height: int, line: float) -> tuple[int, int]:
    """Return the pixels by which lines of numbers reach beyond the upper and the lower end of a bar."""
    fractions = [fraction for fraction, _ in numbers]
    above, below = (round(max(line / 2 - each * height, 0)) for each in (1 - max(fractions), min(fractions)))
    return above, below


def _draw(sheet: Sheet, legend: _Legend, left: int, top: int) -> None:
    y, em = top, sheet.em
    for text in legend.captions:
        _write(sheet, text, left, y + _LINE * em / 2, _SCALE)
        y += round(_LINE * em)
    if legend.bar is not None:
        _draw_bar(sheet, legend.bar, legend, left, y + legend.above)
        y += legend.above + legend.height
        if legend.plot:
            step = _LINE * em * _SMALL
            _write(sheet, "1", left, y + step / 2 + em * 0.1, _SMALL)
            sheet.text("0", (left + legend.plot, y + step / 2 + em * 0.1), _SMALL)
            for number, text in enumerate(legend.bar.opacity_of):
                _write(sheet, text, left, y + (1.5 + number) * step, _SMALL)
        y += legend.below
    for name, color in legend.entries:
        middle = y + _LINE * em / 2
        if color is not None:
            side = round(0.9 * em)
            top = round(middle) - side // 2
            sheet.paint(np.ones((side, side)), left, top, np.broadcast_to(color, (side, side, 3)))
            _frame(sheet, Rect(left, top, left + side, top + side))
        _write(sheet, name, left + (_LINE * em if color is not None else 0.0), middle, _SCALE)
        y += round(_LINE * em)


def _draw_bar(sheet: Sheet, bar: ColorBar, legend: _Legend, left: int, top: int) -> None:
    width, height = round(_BAR * sheet.em), legend.height
    start, end = left + legend.plot, left + legend.plot + width
    fractions = 1 - (np.arange(height * _FINER) + 0.5) / (height * _FINER)
    values = bar.low + fractions * (bar.high - bar.low)
    looks = bar.colors(values).reshape(height, _FINER, 3)
    there = np.isfinite(looks[..., 0])
    colors = np.where(there[..., np.newaxis], looks, 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)[:, np.newaxis]
    bar_colors = np.repeat(colors[:, np.newaxis], width, axis=1)
    sheet.paint(np.repeat(there.mean(axis=1)[:, np.newaxis], width, axis=1), start, top, bar_colors)
    if legend.plot and bar.opacities is not None:
        _draw_opacity(sheet, bar.opacities(values).reshape(height, _FINER), colors, left, top, legend.plot)
    for value, color, opacity in bar.contours:
        if bar.low <= value <= bar.high:
            y = top + (bar.high - value) / (bar.high - bar.low) * height
            reach = opacity * legend.plot
            sheet.rectangle(Rect(start - reach, y - sheet.width, end, y + sheet.width), color=color)
    _frame(sheet, Rect(start, top, end, top + height))
    if legend.plot:
        _frame(sheet, Rect(left, top, start, top + height))
    for fraction, text in legend.numbers:
        y = top + (1 - fraction) * height
        sheet.line((end, y), (end + _TICK * sheet.em, y))
        _write(sheet, text, end + (_TICK + _GAP) * sheet.em, y, _SCALE)


def _draw_opacity(sheet: Sheet, opacities: Numbers, colors: Numbers, left: int, top: int, width: int) -> None:
    """Draw the opacity of each row as a bar from the right, in the row's colour, and a line along the bars' ends."""
    height = len(opacities)
    from_right = np.arange(width)[::-1]
    covered = np.clip(opacities[..., np.newaxis] * width - from_right, 0, 1).mean(axis=1)
    sheet.paint(covered, left, top, np.repeat(colors[:, np.newaxis], width, axis=1))
    ends = np.column_stack([width * (1 - opacities.mean(axis=1)), np.arange(height) + 0.5])
    curve = np.zeros((height, width))
    # Each pixel takes the largest coverage of any line segment: joints would count twice in a sum.
    for start, end in pairwise(ends):
        mark = marks.line(tuple(start), tuple(end), sheet.width, sheet.color, (width, height))
        np.maximum.at(curve, (mark.rows, mark.columns), mark.coverage)
    sheet.paint(curve, left, top, np.broadcast_to(sheet.color, (height, width, 3)), "line")


def _numbers(sheet: Sheet, bar: ColorBar, height: int) -> tuple[list[tuple[float, str]], str]:
    """Return positions of round numbers, as fractions of the bar from below, with their texts, and a common factor."""
    if not bar.high > bar.low:
        return [(0.5, rounding.plain(bar.low))], ""
    step = rounding.round_up((bar.high - bar.low) * min(_CLOSEST * sheet.em / height, 1.0))
    values = rounding.multiples(bar.low, bar.high, step)
    texts, factor = rounding.written(values, step)
    fractions = [(float(value) - bar.low) / (bar.high - bar.low) for value in values]
    if not values:
        return [(0.0, rounding.plain(bar.low)), (1.0, rounding.plain(bar.high))], ""
    return list(zip(fractions, texts, strict=True)), factor


def _frame(sheet: Sheet, rect: Rect) -> None:
    left, top, right, bottom = rect
    corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]
    for start, end in pairwise(corners):
        sheet.line(start, end)


def _write(sheet: Sheet, text: str, left: float, middle: float, scale: float) -> None:
    """Draw a line of text that begins at `left`."""
    sheet.text(text, (left + sheet.text_size(text, scale)[0] / 2, middle), scale)
