"""Colours and opacity, each chosen without the other: colour maps, reversed or in steps, and opacity shapes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from imgui_bundle import imgui

from texvol.scene.transfer import TransferFunction
from texvol.window import choosing, color_maps, lineage, look_list, opacity_shapes, strips
from texvol.window.catalogue import Catalogue
from texvol.window.color_maps import MOST_LEVELS
from texvol.window.desk import Desk
from texvol.window.look_list import OF_LOOK, Entry
from texvol.window.panels import chooser, parts
from texvol.window.panels.chooser import Listing

_MAPS, _SHAPES = "list of colour maps", "list of opacity shapes"
_NOT_LAYERED = {look_list.FILES, "colour maps", "from the histogram"}  # groups whose looks are not in these lists

Set = Callable[[Callable[[], TransferFunction | None]], object]


@dataclass
class Layering:
    """State of the choice of colours and opacities: the lists, and a key that was chosen before its look was made."""

    maps: Listing = field(default_factory=Listing)
    shapes: Listing = field(default_factory=Listing)
    awaited: tuple[str, str] = ("", "")  # list and key


def show(
    desk: Desk, state: Layering, looks: Callable[[], Catalogue], medium: TransferFunction, length: float, change: Set
) -> None:
    """Show colours and opacity side by side, each with the list that others are chosen from."""
    choice = lineage.lineage_of(medium).colors
    width = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
    key, title = medium, "colours" if choice is None else choice.name
    if chooser.button(desk, "colours", title, key, lambda: strips.of_stops(lineage.palette_of(medium)), width):
        chooser.open_list(_MAPS, state.maps, "" if choice is None else choice.name)
    if imgui.is_popup_open(_MAPS):
        _maps(desk, state, looks(), medium, change)
    imgui.same_line()
    if chooser.button(desk, "opacity", "opacity", (key, length), lambda: strips.of_opacity(medium, length), width):
        chooser.open_list(_SHAPES, state.shapes, "")
    if imgui.is_popup_open(_SHAPES):
        _shapes(desk, state, looks(), medium)
    if state.awaited[1]:
        _take(desk, state, looks(), medium, length, change)


def _maps(desk: Desk, state: Layering, catalogue: Catalogue, medium: TransferFunction, change: Set) -> None:
    entries = [
        Entry(name, group, name, text) for group, names in color_maps.GROUPS.items() for name, text in names.items()
    ]

    def options() -> None:
        now = choosing.chosen_map(medium)
        wanted = replace(now, reversed=parts.switch("reversed", now.reversed))
        imgui.same_line()
        imgui.set_next_item_width(-imgui.calc_text_size("steps ").x - 2 * imgui.get_style().item_spacing.x)
        text = f"{now.levels} colours" if now.levels else "smooth"
        levels = round(parts.slider("steps", now.levels, 0, MOST_LEVELS, text.replace("%", "")))
        wanted = replace(wanted, levels=levels)
        if wanted != now:
            change(lambda: choosing.colored(medium, wanted))

    chosen = chooser.choice(
        desk, _MAPS, state.maps, entries + _of_looks(catalogue), catalogue.maps, state.maps.marked, {}, options
    )
    if chosen:
        state.awaited = _MAPS, chosen


def _shapes(desk: Desk, state: Layering, catalogue: Catalogue, medium: TransferFunction) -> None:
    entries = [Entry(name, "shapes", name, text) for name, (_, text) in opacity_shapes.SHAPES.items()]
    chosen = chooser.choice(
        desk, _SHAPES, state.shapes, entries + _of_looks(catalogue), catalogue.shapes, state.shapes.marked, {}
    )
    if chosen:
        state.awaited = _SHAPES, chosen


def _of_looks(catalogue: Catalogue) -> list[Entry]:
    """Return the looks that colours or opacities can be taken from."""
    return [
        replace(each, key=OF_LOOK + each.key, group=f"of looks: {each.group}")
        for each in catalogue.entries
        if each.group not in _NOT_LAYERED
    ]


def _take(
    desk: Desk, state: Layering, catalogue: Catalogue, medium: TransferFunction, length: float, change: Set
) -> None:
    """Set the colours or the opacity that was chosen, as soon as its look is made."""
    which, key = state.awaited
    name = key.removeprefix(OF_LOOK)
    look = catalogue.looks.get(name) if key.startswith(OF_LOOK) else None
    if key.startswith(OF_LOOK) and look is None and name not in catalogue.faults:
        return
    state.awaited = "", ""
    if name in catalogue.faults and look is None and key.startswith(OF_LOOK):
        desk.say(catalogue.faults[name], fault=True)
    elif which == _MAPS:
        change(lambda: choosing.colored(medium, choosing.map_of(key, look, choosing.chosen_map(medium))))
    elif look is None:
        change(lambda: opacity_shapes.shaped(medium, name, length))
    else:
        change(lambda: choosing.with_opacity_of(medium, look))
