"""Labels of a segmentation in the Medium tab: colour, opacity and visibility of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from imgui_bundle import imgui

from texvol.scene.display import straight_colors
from texvol.scene.label_counts import label_counts
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.labels import OPACITY, LabelLook, label_function
from texvol.scene.volume import Volume
from texvol.window import editing
from texvol.window.desk import Desk
from texvol.window.navigation import triple
from texvol.window.panels import parts

_MOST = 400  # rows


def look_of(medium: TransferFunction, volume: Volume) -> LabelLook:
    """Return the colour of each label, and its opacity over one smallest spacing."""
    labels = label_counts(volume).labels
    optics = medium.classify(labels.astype(np.float64))
    opacities = np.clip(editing.opacity_of(optics.extinction, volume.smallest_spacing), 0, 1)
    colors = np.clip(straight_colors(medium, labels.astype(np.float64)), 0, 1)
    names = labels.tolist()
    return LabelLook(
        dict(zip(names, opacities.tolist(), strict=True)), dict(zip(names, map(triple, colors), strict=True))
    )


def show(desk: Desk, scene: Scene, medium: TransferFunction, number: int) -> None:
    """Show a row for each label."""
    volume, state = scene.volumes[number], desk.panel_state
    if state.get("look_of") is not medium:
        state["look_of"], state["look"] = medium, look_of(medium, volume)
    look: LabelLook = state["look"]
    opacities, colors = look.opacities, look.colors
    pressed = parts.buttons(("show all", "hide all"), 2)
    if pressed == "show all":
        opacities = {name: (opacity or OPACITY) if name else opacity for name, opacity in opacities.items()}
    elif pressed == "hide all":
        opacities = dict.fromkeys(opacities, 0.0)
    names = [name for name in opacities if name]
    for name in names[:_MOST]:
        opacity, color = _row(name, opacities[name], colors[name])
        if (opacity, color) != (opacities[name], colors[name]):
            opacities, colors = opacities | {name: opacity}, colors | {name: color}
    if len(names) > _MOST:
        imgui.text_disabled(f"and {len(names) - _MOST} more")
    if opacities is not look.opacities:
        found = replace(label_function(volume, opacities, colors), name=medium.name)
        # All changes of one drag are one step of the history.
        desk.change("labels", **editing.with_own(scene, number, transfer_function=found))


def _row(name: int, opacity: float, color: parts.Color) -> tuple[float, parts.Color]:
    """Show the row of a label; return its opacity and colour."""
    imgui.push_id(name)
    visible = parts.switch("##shown", opacity > 0)
    imgui.same_line()
    color = parts.color("##color", color, small=True)
    imgui.same_line()
    wanted = parts.slider(f"label {name}", opacity, 0.0, 1.0, "%.2f")
    imgui.set_item_tooltip("opacity of this label over one smallest spacing")
    imgui.pop_id()
    if visible != (opacity > 0):
        wanted = OPACITY if visible else 0.0
    return wanted, color
