"""Choice of a look, and of colours or opacities alone, for a volume of the open scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from texvol.scene.looks import Look, look_of
from texvol.scene.scene import Scene
from texvol.scene.transfer import PRESETS, TransferFunction, adjusting, label_function
from texvol.window import color_maps, editing, label_looks, lineage, look_list, opacity_shapes, recent_looks
from texvol.window.color_maps import MapChoice
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.lineage import Lineage
from texvol.window.look_list import OF_LOOK


def look(desk: Desk, document: Document, name: str) -> None:
    """Set the look of the edited volume to a preset; a command of scripts."""
    number = _edited(desk, document.scene)
    volume = document.scene.volumes[number]
    desk.attempt(lambda: set_look(desk, document.scene, number, name, look_of(name, volume)))


def colors(desk: Desk, document: Document, name: str) -> None:
    """Give the edited volume the colours of a map; a command of scripts."""
    _change(desk, document.scene, lambda medium: colored(medium, map_of(name, None, chosen_map(medium))))


def shape(desk: Desk, document: Document, name: str) -> None:
    """Give the edited volume an opacity shape; a command of scripts."""
    volume = document.scene.volumes[_edited(desk, document.scene)]
    length = editing.plot_length(volume)
    _change(desk, document.scene, lambda medium: opacity_shapes.shaped(medium, name, length))


def set_look(desk: Desk, scene: Scene, number: int, key: str, chosen: Look) -> None:
    """Set the look of a volume, of a key as in `look_list`; the light of a file comes with it."""
    medium = chosen.transfer_function
    is_own = key in (look_list.PROPOSED, look_list.OPENED)
    if key in PRESETS:
        lineage.remembered(medium, Lineage(key, materials=medium.materials, shown=frozenset(medium.materials)))
    elif key == look_list.PROPOSED:
        lineage.remembered(medium, Lineage(chosen.name or key))
    is_file = key not in PRESETS and not is_own
    if is_file:
        recent_looks.add(key)
    changes = editing.with_file(scene, chosen) if is_file and number == 0 else editing.with_look(scene, number, chosen)
    desk.change(**changes)


def color_labels(desk: Desk, scene: Scene, number: int, name: str) -> None:
    """Give labels the colours of a list; opacities stay."""
    volume, medium = scene.volumes[number], editing.owner_of(scene, number).transfer_function
    assert medium is not None
    opacities = label_looks.look_of(medium, volume).opacities
    desk.change(**editing.with_own(scene, number, transfer_function=label_function(volume, opacities, name)))


def colored(medium: TransferFunction, choice: MapChoice) -> TransferFunction:
    """Return the transfer function in the colours of a map, over the values of the colours that it has."""
    palette = lineage.layers_of(medium).palette
    ends = (palette[0][0], palette[-1][0]) if palette and palette[0][0] < palette[-1][0] else adjusting.ends(medium)
    return lineage.recolored(medium, color_maps.placed(choice.shown, ends), choice)


def chosen_map(medium: TransferFunction) -> MapChoice:
    """Return the colour map of a transfer function; the colours that it came with are one as well."""
    found = lineage.lineage_of(medium)
    return found.colors or MapChoice(found.name, color_maps.fractions_of(lineage.palette_of(medium)))


def map_of(name: str, of_look: Look | None, before: MapChoice) -> MapChoice:
    """Return the choice of a colour map, or of the colours of a look; it is reversed and in steps as the one before."""
    if of_look is None:
        return replace(before, name=name, stops=color_maps.map_stops(name))
    stops = color_maps.fractions_of(lineage.palette_of(of_look.transfer_function))
    return replace(before, name=name.removeprefix(OF_LOOK), stops=stops)


def with_opacity_of(medium: TransferFunction, of_look: Look) -> TransferFunction:
    """Return the transfer function with the opacity of a look, at the look's own values."""
    points = lineage.layers_of(of_look.transfer_function).curve.points
    return opacity_shapes.with_opacities(medium, [(point.value, point.extinction) for point in points])


def _edited(desk: Desk, scene: Scene) -> int:
    return min(int(desk.panel_state.get("volume", 0)), len(scene.added))


def _change(desk: Desk, scene: Scene, make: Callable[[TransferFunction], TransferFunction]) -> None:
    number = _edited(desk, scene)
    medium = editing.owner_of(scene, number).transfer_function
    if medium is not None and not scene.volumes[number].labels:
        desk.attempt(lambda: desk.change(**editing.with_own(scene, number, transfer_function=make(medium))))
