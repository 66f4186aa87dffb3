"""Medium tab: mode, classification, look, colours, opacity, and the plot of the transfer function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from imgui_bundle import imgui

from texvol.scene.air import is_told_hounsfield
from texvol.scene.display import number_colors
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.scene.transfer import TransferFunction, adjusting
from texvol.scene.volume import Volume
from texvol.window import editing, lineage
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.naming import volume_called
from texvol.window.panels import axis, labels, layering, looks, mode, parts, plot, point
from texvol.window.panels.plot import Canvas
from texvol.window.ranges import Ends

_LETTERS = 22  # of a file name: leaves room for a channel's number
_ROWS = 3  # of controls below the plot
_WHEEL = 0.7  # seconds between notches that are one step of the history
_NUMBER = 0.3  # of the width, of a field


@dataclass
class MediumState:
    """State of the tab for one volume."""

    volume: Volume
    length: float  # of the path whose opacity is shown, world units
    canvas: Canvas = field(default_factory=Canvas)
    looks: looks.Looks = field(default_factory=looks.Looks)
    layering: layering.Layering = field(default_factory=layering.Layering)
    bounds_of: TransferFunction | None = None


def show(desk: Desk, document: Document) -> None:
    """Show the Medium tab."""
    scene = document.scene
    mode.show(desk, scene)
    imgui.separator_text("Transfer function")
    number = _volume_number(desk, scene)
    volume, medium = scene.volumes[number], editing.owner_of(scene, number).transfer_function
    if medium is None:
        parts.steps(desk)
        imgui.text_disabled("No transfer function: the mode shows numbers." if number == 0 else "No transfer function.")
        return
    if scene.mode in NUMBER_MODES and number_colors(scene, document.showing.window) is None:
        imgui.text_disabled("The mode shows numbers and does not use the transfer function.")
    state = _state_of(desk, volume)
    looks.show(desk, document, state.looks, medium, number, state.length)
    if volume.labels:
        labels.show(desk, scene, medium, number)
        return
    made = lambda: state.looks.made_for(desk, volume, number, state.length)  # noqa: E731
    layering.show(desk, state.layering, made, medium, state.length, lambda make: _set(desk, number, make))
    _curve(desk, document, state, medium, number)


def _volume_number(desk: Desk, scene: Scene) -> int:
    """Return the number of the edited volume; show a choice if there are several volumes."""
    state = desk.panel_state
    if not scene.added:
        return 0
    names = [f"{position + 1}: {volume_called(each, _LETTERS)}" for position, each in enumerate(scene.volumes)]
    imgui.set_next_item_width(-1)  # wide, because names of volumes from one file differ at their ends
    number = names.index(parts.choice("##volume", names[min(state.get("volume", 0), len(names) - 1)], names))
    imgui.set_item_tooltip(f"volume {number + 1}, whose look is edited: {volume_called(scene.volumes[number])}")
    state["volume"] = number
    return number


def _state_of(desk: Desk, volume: Volume) -> MediumState:
    """Return the state of the tab; it is forgotten when another volume is edited."""
    state: MediumState | None = desk.panel_state.get("medium")
    if state is None or state.volume is not volume:
        if state is not None:
            state.looks.stop()
        state = desk.panel_state["medium"] = MediumState(volume, editing.plot_length(volume))
    return state


def _set(desk: Desk, number: int, make: Callable[[], TransferFunction | None], stroke: str | None = None) -> bool:
    """Set the transfer function that `make` returns; show the message of its error."""

    def change() -> None:
        assert desk.document is not None
        found = make()
        if found is not None:
            desk.change(stroke, **editing.with_own(desk.document.scene, number, transfer_function=found))

    return desk.attempt(change)


def _curve(desk: Desk, document: Document, state: MediumState, medium: TransferFunction, number: int) -> None:
    """Show the plot, and what is aligned with its axis or belongs to the whole curve."""
    volume, canvas = state.volume, state.canvas
    histogram = document.histogram(volume)
    ends = adjusting.ends(medium)
    if state.bounds_of is not medium and canvas.pressed is None and not imgui.is_any_item_active():
        # The range of the histogram is extended to the curve's ends, so that all points can be reached.
        low, high = histogram.edges[[0, -1]].tolist()
        state.bounds_of, canvas.bounds = medium, (min(low, ends[0]), max(high, ends[1]))
    texts = f"opacity over {state.length:.3g} {volume.unit or 'units'}", _values_of(volume)
    assert desk.textures is not None
    outcome, frame = plot.show(canvas, histogram, medium, state.length, _room(), texts, desk.textures)
    if outcome.opens:
        point.open_at(canvas, frame, medium, state.length)
    edited = outcome.medium or point.show(canvas, medium, state.length, volume.unit)
    under = axis.Axis(frame.shown, frame.left, frame.width)
    axis.bar(under, medium)
    wanted = axis.track(under, desk.panel_state, ends, canvas.bounds, frame.rounded)
    _whole(desk, state, medium, number, ends)
    if edited is not None and edited is not medium:
        _wheel(desk, document, canvas, edited, medium)
        _set(desk, number, lambda: edited, "curve")
    elif wanted != ends:
        _set(desk, number, lambda: lineage.adjusted(medium, wanted), "curve")


def _values_of(volume: Volume) -> str:
    """Return the name of a volume's values."""
    return "HU" if is_told_hounsfield(volume) else "value"


def _room() -> float:
    """Return the height that the tab leaves for the plot."""
    style, scale = imgui.get_style(), parts.scale()
    below = axis.height() + _ROWS * imgui.get_frame_height_with_spacing() + 2 * style.item_spacing.y
    # Scrolling moves the cursor up and adds to what seems to be left.
    return max(imgui.get_content_region_avail().y - imgui.get_scroll_y() - below, plot.LOWEST * scale)


def _wheel(desk: Desk, document: Document, canvas: Canvas, edited: TransferFunction, medium: TransferFunction) -> None:
    """Take notches of the wheel that follow each other for one step of the history."""
    if not imgui.get_io().mouse_wheel:
        canvas.turned = None
        return
    before = canvas.turned
    if before is not None and before[0] is medium and desk.now - before[1] < _WHEEL:
        document.history.resume("curve")
    canvas.turned = edited, desk.now


def _whole(desk: Desk, state: MediumState, medium: TransferFunction, number: int, ends: Ends) -> None:
    """Show numbers of the whole curve: its range, the factor of its opacity, and the length of the opacity."""
    width = _NUMBER * imgui.get_content_region_avail().x
    imgui.begin_disabled(not ends[1] > ends[0])
    imgui.set_next_item_width(width)
    low = parts.number("##low", ends[0])
    imgui.same_line()
    imgui.set_next_item_width(width)
    high = parts.number("range", ends[1])
    imgui.end_disabled()
    if (low, high) != ends:
        if low < high:
            _set(desk, number, lambda: lineage.adjusted(medium, (low, high)))
        else:
            desk.say(f"range must be LOW, HIGH with LOW under HIGH, got {low:g} and {high:g}", fault=True)
    factor = lineage.lineage_of(medium).factor
    imgui.set_next_item_width(width)
    wanted = parts.number("opacity x", factor)
    if wanted != factor:
        if 0 <= wanted <= 1e6:
            _set(desk, number, lambda: lineage.adjusted(medium, factor=wanted))
        else:
            desk.say(f"opacity must be a factor from 0 to 1e6, got {wanted:g}", fault=True)
    imgui.same_line(2 * (width + imgui.get_style().item_spacing.x))
    state.canvas.logarithmic = parts.switch("log", state.canvas.logarithmic)
    imgui.set_next_item_width(width)
    length = parts.number(f"opacity is per ({state.volume.unit or 'units'})", state.length)
    if length > 0:
        state.length = length
