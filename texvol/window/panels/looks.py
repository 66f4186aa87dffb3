"""Looks in the Medium tab: the button with the strip of the look, the list to choose from, and materials."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from imgui_bundle import imgui

from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction, adjusting, preset
from texvol.scene.volume import Volume
from texvol.window import choosing, editing, lineage, look_list, recent_looks, strips
from texvol.window.catalogue import Catalogue
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.lineage import Lineage
from texvol.window.panels import chooser, parts
from texvol.window.panels.chooser import Listing

_LIST = "list of looks"


@dataclass
class Looks:
    """State of the choice of a look: the list, the looks in it, and one that was chosen before it was made."""

    listing: Listing = field(default_factory=Listing)
    catalogue: Catalogue | None = None
    awaited: str = ""
    files: list[str] = field(default_factory=list)

    def stop(self) -> None:
        """End the thread that makes the looks."""
        if self.catalogue is not None:
            self.catalogue.stop()

    def made_for(self, desk: Desk, volume: Volume, number: int, length: float) -> Catalogue:
        """Return the looks of a volume; their thread is started at the first call, and when files have been used."""
        assert desk.document is not None
        files = recent_looks.files() if self.listing.focuses or self.catalogue is None else self.files
        if self.catalogue is None or (files != self.files and not volume.labels):
            self.stop()
            opened = _opened_with(desk.document, volume)
            entries = look_list.of_labels() if volume.labels else look_list.measured(files)
            entries = [each for each in entries if each.key != look_list.OPENED or opened is not None]
            self.catalogue, self.files = Catalogue(volume, number, entries, opened, length, desk.wake).start(), files
        return self.catalogue


def show(desk: Desk, document: Document, state: Looks, medium: TransferFunction, number: int, length: float) -> None:
    """Show the look of a volume, with the list that another one is chosen from, and its materials."""
    scene, found = document.scene, lineage.lineage_of(medium)
    volume = scene.volumes[number]
    width = imgui.get_content_region_avail().x - parts.width_of_steps()
    title = "labels" if volume.labels else found.title
    if chooser.button(desk, "look", title, medium, lambda: strips.of_medium(medium, length), width):
        chooser.open_list(_LIST, state.listing, found.name)
    if imgui.is_popup_open(_LIST) or state.awaited:
        catalogue = state.made_for(desk, volume, number, length)
        state.awaited = (
            chooser.choice(
                desk, _LIST, state.listing, catalogue.entries, catalogue.sheet, found.name, catalogue.faults
            ) or state.awaited
        )  # fmt: skip
        _take(desk, scene, number, state, catalogue)
    imgui.same_line()
    parts.steps(desk)
    if not found.changed:
        _materials(desk, scene, medium, number, found)


def _take(desk: Desk, scene: Scene, number: int, state: Looks, catalogue: Catalogue) -> None:
    """Set the look that was chosen, as soon as it is made."""
    key = state.awaited
    if not key:
        return
    if key in catalogue.looks:
        state.awaited = ""
        look = catalogue.looks[key]
        desk.attempt(lambda: choosing.set_look(desk, scene, number, key, look))
    elif scene.volumes[number].labels:
        state.awaited = ""
        desk.attempt(lambda: choosing.color_labels(desk, scene, number, key))
    elif key in catalogue.faults:
        state.awaited = ""
        desk.say(catalogue.faults[key], fault=True)


def _materials(desk: Desk, scene: Scene, medium: TransferFunction, number: int, found: Lineage) -> None:
    """Show switches of a preset's materials; range and opacity stay as they are."""
    switched = parts.switches({name: name in found.shown for name in found.materials})
    chosen = tuple(name for name, is_shown in switched.items() if is_shown)
    if not chosen or set(chosen) == found.shown:
        return

    def change() -> None:
        base = preset(found.name, scene.volumes[number], chosen)
        lineage.remembered(base, Lineage(found.name, materials=found.materials, shown=frozenset(chosen)))
        # The ends of what is shown are placed as the range has placed the ends of what was shown.
        before, after = adjusting.ends(found.base or medium), adjusting.ends(medium)
        low, high = adjusting.placed(np.array(adjusting.ends(base)), before, after).tolist()
        adjusted = lineage.adjusted(base, (low, high) if before != after else None, found.factor)
        desk.change(**editing.with_own(scene, number, transfer_function=adjusted))

    desk.attempt(change)


def _opened_with(document: Document, volume: Volume) -> TransferFunction | None:
    """Return the transfer function that a volume was opened with; None if it was added later."""
    volumes = document.opened.volumes
    if volume not in volumes:
        return None
    return editing.owner_of(document.opened, volumes.index(volume)).transfer_function
