"""Tooltips of controls, by the controls' labels."""

from __future__ import annotations

from imgui_bundle import imgui

TIPS = {
    # Tabs
    "Medium": "which values show, in which colours",
    "Scene": "volumes, masks and meshes",
    "View": "camera, background, annotation and quality",
    "Light": "lights, and how matter reflects them",
    "Cut": "crop box and clip planes",
    "Slices": "axial, coronal and sagittal slices (l)",
    "Measure": "lengths, angles, boxes, profiles, and volumes of labels (m)",
    "File": "open, save, pictures and films",
    # Medium
    "mode": "how values become a picture: emission and absorption, a surface, the greatest value, or an X-ray",
    "classification": "whether values are interpolated before or after the transfer function; auto is the exact one",
    "isovalue": "value of the surface",
    "integrates": "what an X-ray sums up along each ray",
    "value of air": "values up to this one count as nothing",
    "numbers": "how the picture's numbers are shown: as grey values, or in the colours of the transfer function",
    "automatic black and white": "black and white are the least and the greatest number of the picture",
    "centre": "number that is shown as middle grey",
    "width": "distance from black to white",
    "##volume": "volume whose transfer function is edited",
    "##look": "look of the volume, with * if it was changed; choose another one from a list",
    "##colours": "colours, from a list of colour maps; the opacity stays",
    "##opacity": "opacity, from a list of shapes; the colours stay",
    "reversed": "the colours of the high end come to the low end",
    "steps": "as many colours with borders between them; 0 changes colours continuously",
    "log": "logarithmic histogram: rare values are seen beside frequent ones",
    "opacity is per": "length of the path whose opacity the curve shows",
    "##low": "least value of the curve, as --range LOW,HIGH; the points between move along",
    "opacity x": "makes the volume so many times as dense, as --opacity",
    "colour": "colour of the selected point, or of the light",
    "value": "value of the selected point, in units of the data",
    "opaque": "the point hides everything behind it",
    "extinction /": "extinction of the selected point, for each unit of length",
    "opacity /": "opacity of the selected point, over this length",
    "range": "greatest value of the curve, as --range LOW,HIGH; the points between move along",
    "undo": "ctrl-z; beyond the first step, back to the scene before",
    "redo": "ctrl-shift-z",
    "show all": "show every label that is listed",
    "hide all": "hide every label that is listed",
    "names …": "names and colours from a file: ITK-SNAP, FreeSurfer, 3D Slicer, FSL, or lines of label and name",
    "##label opacity": "opacity of this label, over the distance of two samples",
    "##shown": "show or hide this label",
    # Scene
    "##color": "colour",
    "opacity": "from almost invisible to opaque",
    "as labels": "values are names of parts, never mixed: each one gets a colour of its own",
    "fades in": "weights rise from 0 at the first value to 1 at the second",
    # Time bar
    "##step back": "the time step before (,)",
    "##play": "play the time steps, or pause (space)",
    "##step on": "the time step after (.)",
    "##time step": "time step that is shown; ctrl-click to type one",
    "steps/s": "most time steps per second while they are played",
    # View
    "projection": "orthographic keeps sizes, perspective makes what is near larger (o)",
    "turning": "a turntable keeps the vertical upright (t)",
    "field of view": "vertical angle of the picture ([ and ])",
    "height": "height of the picture, in units of the world",
    "reset": "the view of texvol render (r)",
    "frame": "the whole volume, from this direction (f)",
    "background": "colour behind everything",
    "title": "text above the picture",
    "depth cue": "what is farther fades into the background",
    "box": "edges of the volume",
    "axes": "directions of the axes x, y and z",
    "scale bar": "a length in the units of the file",
    "legend": "which colours stand for which values",
    "orientation": "directions of the body",
    "frames per second": "pictures in a second that are wanted",
    "error at rest": "greatest error of the picture at rest, in steps of 8 bits",
    "slicing at rest": "how slabs of the picture at rest are drawn",
    "front": "look from the front (--view front)",
    "back": "look from the back (--view back)",
    "left": "look from the left side (--view left)",
    "right": "look from the right side (--view right)",
    "top": "look from above (--view top)",
    "bottom": "look from below (--view bottom)",
    "iso": "look at a corner, from the front, the right and above (--view iso)",
    "anterior": "look from the front of the body (--view front)",
    "posterior": "look from the back of the body (--view back)",
    "superior": "look from the head (--view top)",
    "inferior": "look from the feet (--view bottom)",
    "+x": "look from +x (x)",
    "-x": "look from -x (shift-x)",
    "+y": "look from +y (y)",
    "-y": "look from -y (shift-y)",
    "+z": "look from +z (z)",
    "-z": "look from -z (shift-z)",
    "orientation cube": "the cube in the corner of the picture: click a face, an edge or a corner, or drag it",
    "back to the first": "the path leads from the last view to the first, so that the film can be repeated",
    "stop at each": "the camera stops at each view; else it passes through",
    # Light
    "head": "one light at the eye",
    "three-point": "a warm key light, a weak fill light, and a rim light from behind, placed for this view",
    "studio": "large soft lights: even, with little shadow, placed for this view",
    "brightness": "strength of the light",
    "##light color": "colour of the light",
    "from": "direction from which the light comes; drag, or double-click to type",
    "at": "position of the light; drag, or double-click to type",
    "light": "on or off; a light that is switched off comes back as it was",
    "ambient": "light from everywhere",
    "diffuse": "matt reflection",
    "specular": "highlights",
    "shininess": "the greater, the smaller the highlights",
    "two-sided": "surfaces that face away from the light are lit as well",
    "shadows": "the medium shades itself; slower",
    "kind": "at the eye, from a direction, or at a point",
    # Cut
    "crop box": "on or off; a box that is switched off comes back as it was",
    "caps: opaque cut surfaces": "cuts show the values on their surface",
    "x##crop": "ends of the box along x; drag one, or double-click to type",
    "y##crop": "ends of the box along y; drag one, or double-click to type",
    "z##crop": "ends of the box along z; drag one, or double-click to type",
    "x": "a plane perpendicular to the axis x, through the middle",
    "y": "a plane perpendicular to the axis y, through the middle",
    "z": "a plane perpendicular to the axis z, through the middle",
    "view": "a plane perpendicular to the direction of view, through the middle",
    "position": "distance of the plane from the middle of the box",
    # Slices
    "level": "value that is shown as middle grey",
    "window": "range of values from black to white",
    "2 x 2": "axial, coronal and sagittal slices beside the 3D view (g)",
    "3D alone": "the 3D view without slices beside it (g)",
    "further volumes": "opacity of further volumes over the first one",
    "outlines in 3D": "where the slices are in the 3D view",
    "slices in 3D": "the slices themselves in the 3D view",
    "turn about it": "the 3D view turns about the point of the crosshair",
    "whole slices": (
        "zoom and position as at first. In a slice: drag with the left button to move the crosshair, with the middle\n"
        "button to move the slice, with the right button to change window and level; turn the wheel to go through\n"
        "the slices, with ctrl to zoom; double click to enlarge it."
    ),
    # Measure
    "##shown measure": "drawn into pictures, or only listed",
    # Foot
    "details": "error, slabs, size and time of the picture, and what is modelled",
    # File
    "film of": "what the camera does in the film",
    "axis": "axis of the turns, through the point that the camera looks at",
    "error of films": "greatest error of the first picture, in steps of 8 bits; a quarter takes twice as long",
    "turns": "how often the camera goes around",
    "camera goes": "direction of the turns",
    "transparent background": "picture files keep their opacity",
    "hidden files": "names that begin with a dot (ctrl-h)",
}


def tip(label: str) -> str:
    """Return the tooltip of a control; "" if it has none. Units and lengths in a label are not part of its name."""
    name = label.split(" (")[0]
    head, slash, _ = name.partition(" /")
    return TIPS.get(head + slash, "")


def show(label: str) -> None:
    """Give the control that was shown last its tooltip."""
    text = tip(label)
    if text:
        imgui.set_item_tooltip(text)
