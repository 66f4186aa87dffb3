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
from texvol.window.panels import parts

_MOST = 400  # rows


def look_of(medium: TransferFunction, volume: Volume) -> LabelLook:
    """Return the colour of each label, and its opacity over one smallest spacing."""
    labels = label_counts(volume).labels
    optics = medium.classify(labels.astype(np.float64))
    opacities = np.clip(editing.opacity_of(optics.extinction, volume.smallest_spacing), 0, 1)
    colors = np.clip(straight_colors(medium, labels.astype(np.float64)), 0, 1)
    names = [int(label) for label in labels]
    return LabelLook(
        dict(zip(names, opacities.tolist(), strict=True)),
        {name: (float(red), float(green), float(blue)) for name, (red, green, blue) in zip(names, colors, strict=True)},
    )


def show(desk: Desk, scene: Scene, medium: TransferFunction, number: int) -> None:
    """Show a row for each label."""
    volume, state = scene.volumes[number], desk.panel_state
    if state.get("look_of") is not medium:
        state["look_of"], state["look"] = medium, look_of(medium, volume)
    look: LabelLook = state["look"]
    wanted = _all(look)
    names = [name for name in look.opacities if name]
    for name in names[:_MOST]:
        wanted = _row(wanted, name)
    if len(names) > _MOST:
        imgui.text_disabled(f"and {len(names) - _MOST} more")
    if wanted is not look:
        found = label_function(volume, wanted.opacities, wanted.colors)
        # All changes of one drag are one step of the history.
        found = replace(found, name=medium.name)
        desk.change("labels", **editing.with_transfer_function(scene, number, found))


def _all(look: LabelLook) -> LabelLook:
    pressed = parts.buttons(("show all", "hide all"), 2)
    if pressed is None:
        return look
    shown = {name: (opacity or OPACITY) if name else opacity for name, opacity in look.opacities.items()}
    return look._replace(opacities=shown if pressed == "show all" else dict.fromkeys(look.opacities, 0.0))


def _row(look: LabelLook, name: int) -> LabelLook:
    imgui.push_id(name)
    opacity = look.opacities[name]
    changed, visible = imgui.checkbox("##shown", opacity > 0)
    if changed:
        look = look._replace(opacities=look.opacities | {name: OPACITY if visible else 0.0})
    imgui.same_line()
    changed, color = parts.color("##color", look.colors[name], small=True)
    if changed:
        look = look._replace(colors=look.colors | {name: color})
    imgui.same_line()
    changed, opacity = parts.slider(f"label {name}", opacity, 0.0, 1.0, "%.2f")
    if changed:
        look = look._replace(opacities=look.opacities | {name: opacity})
    imgui.pop_id()
    return look
