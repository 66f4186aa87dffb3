"""The pictures of the gallery, as data: what `texvol render` is to be told, and what the picture shows.

`options` are those of the command line, words for word; a transfer function of one's own is beside them, as a file has
it. Accuracy is that of the picture before it is averaged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from support.gallery.volumes import BUILT_IN

Size = tuple[int, int]
_DARK = "--background 0.012,0.014,0.02"
_PAPER = "--background 0.86,0.86,0.84"


@dataclass(frozen=True)
class Entry:
    """One picture.

    Attributes
    ----------
    name, caption : str
    volume : str
        Name of a built-in volume, or a file in the folder of data.
    options : str
        What is drawn, and how the file is read.
    transfer_function : dict, optional
        As its JSON file has it.
    size : (width, height)
        Pixels of the finished picture.
    sampling_rate : float
        Slabs per smallest spacing.
    depth : bool
        Whether there is a picture of the isosurface's depth as well.
    """

    name: str
    caption: str
    volume: str
    options: str
    transfer_function: dict[str, Any] | None = None
    size: Size = (480, 480)
    sampling_rate: float = 2.0
    depth: bool = False

    @property
    def is_built_in(self) -> bool:
        """Whether it needs no file."""
        return self.volume in BUILT_IN


def _point(value: float, color: tuple[float, float, float], extinction: float) -> dict[str, Any]:
    return {"value": value, "color": list(color), "extinction": extinction}


def _contour(value: float, color: tuple[float, float, float], extinction: float) -> dict[str, Any]:
    return {"value": value, "thickness": 2, "color": list(color), "extinction": extinction}


def _material(name: str, ends: dict[str, Any], color: tuple[float, float, float], extinction: float) -> dict[str, Any]:
    return {"name": name, **ends, "color": list(color), "extinction": extinction}


_REAL = (
    Entry(
        "head",
        "Skin over bone: an isovalue contour, translucent, over an opaque material; Phong shading, a warm light and a "
        "cool one. CT of the Visible Human.",
        "male/male.raw.bz2",
        "--shape 128,256,256 --dtype uint8 --spacing 1.5777,0.99586,1.008 --classification post --gradient gaussian:1 "
        "--light 0.8,-1,-0.9:1,0.95,0.88 --light -1,-0.1,-0.2:0.3,0.5,0.8 --ambient 0.15 --specular 0.35 "
        f"--up 0,0,-1 --eye 243,-477,95 --target 108,123,131 --height 258 {_DARK}",
        {
            "contours": [{"value": 60, "thickness": 1.5, "color": [0.80, 0.46, 0.32], "extinction": 0.2}],
            "materials": [_material("bone", {"from": [95, 130]}, (0.95, 0.86, 0.70), 1.5)],
        },
        size=(352, 480),
    ),
    Entry(
        "radiograph",
        "X-ray: the line integral of the value, through a window. The same head from the side.",
        "male/male.raw.bz2",
        "--shape 128,256,256 --dtype uint8 --spacing 1.5777,0.99586,1.008 --mode xray --window 8200,16400 "
        "--up 0,0,-1 --eye 600,124,131 --target 100,124,131 --height 246",
    ),
    Entry(
        "engine",
        "Gradient modulation: metal shows where its value changes, and the block becomes glass. CT of a two-cylinder "
        "engine.",
        "engine/engine.nii.gz",
        "--classification post --light 0.2,-1,1.2 --light head:0.3 --specular 0.4 "
        f"--eye 520,-640,420 --target 3,0.5,-4 --height 222 {_PAPER}",
        {
            "gradients": "relative",
            "points": [
                _point(60, (0.35, 0.50, 0.60), 0),
                _point(90, (0.35, 0.50, 0.60), 0.12),
                _point(150, (0.45, 0.55, 0.60), 0.12),
                _point(180, (0.90, 0.50, 0.12), 1.5),
                _point(255, (1.00, 0.75, 0.30), 3),
            ],
            "gradient": [[0.02, 0], [0.2, 1]],
        },
        size=(480, 420),
    ),
    Entry(
        "brain",
        "Gouraud shading of two materials that overlap softly; gradients smoothed over a voxel or two, without "
        "which each voxel would show. MR template, T1.",
        "brain/mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz",
        "--classification extinction --gradient gaussian:1.4 --light -1,0.9,1.2:1,0.93,0.86 "
        "--light 1,0.2,-0.1:0.25,0.4,0.75 --ambient 0.1 --specular 0.3 --shininess 20 "
        f"--eye -330,300,210 --target 0,-18,18 --height 170 {_DARK}",
        {
            "materials": [
                _material("grey matter", {"from": [85, 105], "to": [170, 185]}, (0.80, 0.50, 0.42), 0.8),
                _material("white matter", {"from": [170, 185]}, (0.95, 0.85, 0.72), 2),
            ]
        },
        size=(480, 440),
    ),
    Entry(
        "tooth",
        "A transfer function proposed from the histogram, untouched: it finds dentine and enamel. Micro CT.",
        "tooth/tooth.nhdr",
        "--tf histogram --classification post --light 0.3,-1,1 --light head:0.3 --ambient 0.15 --specular 0.3 "
        f"--eye 250,-300,180 --target 51,46.5,77 --height 168 {_DARK}",
        size=(400, 480),
    ),
    Entry(
        "frog",
        "Labels, none mixed with its neighbour, in the colours of Glasbey's list and with opacities of their own; the "
        "skeleton is thin. A segmented frog, 30 labels.",
        "frog/frog_tissues.vti",
        "--labels --label-look *=0.5,13=0.06 --gradient gaussian:1.5 --light 0.5,-0.6,1.5 --light head:0.3 "
        "--ambient 0.2 --specular 0.2 --up 0,1,0 "
        f"--eye 88,-215,700 --target 250,250,95 --height 392 {_PAPER}",
        size=(480, 400),
        sampling_rate=1.0,
    ),
    Entry(
        "fly",
        "A smoothing estimator of the gradient on noisy data: micro CT of a fly, from above.",
        "fly/fly_150x256x256.tif",
        "--classification post --gradient gaussian:2 --light head:0.5 --light -0.3,0.5,1:0.6 "
        f"--eye 127,127,600 --target 131,112,62 --up 0.55,1,0 --height 222 {_PAPER}",
        {
            "points": [
                _point(20, (0.90, 0.62, 0.20), 0),
                _point(30, (0.80, 0.40, 0.10), 0.12),
                _point(70, (0.50, 0.18, 0.05), 0.4),
                _point(110, (0.35, 0.10, 0.04), 2),
            ]
        },
    ),
)

_BUILT_IN = (
    Entry(
        "orbital",
        "Isovalue contours after Levoy: where the wave function of a hydrogen atom (4f) is ±0.45 and ±0.08 of its "
        "largest value, of even thickness.",
        "orbital",
        "--classification post --light 1,-0.3,1.5 --light head:0.3 --specular 0.5 "
        f"--eye 300,-400,200 --height 114 {_PAPER}",
        {
            "contours": [
                _contour(0.45, (1.00, 0.45, 0.08), 3),
                _contour(0.08, (1.00, 0.30, 0.05), 0.08),
                _contour(-0.45, (0.10, 0.45, 1.00), 3),
                _contour(-0.08, (0.05, 0.30, 1.00), 0.08),
            ]
        },
    ),
    Entry(
        "trefoil",
        "Phong shading, three coloured lights with highlights: the trefoil knot about Milnor's u³ = v², integrated "
        "across a step of the transfer function.",
        "trefoil",
        "--classification integrated --light -1,0.6,0.7:0.95,0.18,0.05 --light 1,0.8,0.5:0.04,0.25,0.95 "
        "--light 0.2,-1,0.8:0.5,0.48,0.4 --specular 0.6 --shininess 60 --ambient 0.05 "
        f"--eye 146.6,-151.6,496 --target 60.4,62.2,59.5 --height 114 {_DARK}",
        {"points": [_point(0.5, (0.9, 0.88, 0.85), 0), _point(0.5, (0.9, 0.88, 0.85), 8)]},
    ),
    Entry(
        "gyroid",
        "Perspective with the eye inside, and a depth cue: far walls of the gyroid fade into the sky.",
        "gyroid",
        "--mode isosurface --isovalue 0 --light head:0.9,0.85,0.8 --light -1,1,2:0.3,0.2,0.1 --ambient 0.15 "
        "--specular 0.25 --shininess 40 --depth-cue 0.97,0.42,0.6,0.7 --background 0.42,0.6,0.7 "
        "--projection perspective --fov 100 --eye 3,62.5,55.5 --target 60,55.5,55.5 --up 0,0.3,1",
        {"points": [_point(0, (0.85, 0.36, 0.22), 1)]},
    ),
    Entry(
        "ripples",
        "An isosurface met between the samples, lit by two coloured point lights, and its depth.",
        "ripples",
        "--mode isosurface --isovalue 0.5 --light point:15,40,72:1,0.35,0.06 --light point:80,50,66:0.06,0.3,1 "
        "--light head:0.12 --ambient 0.03 --specular 0.5 --shininess 60 "
        f"--projection perspective --fov 36 --eye 47.5,-8,92 --target 47.5,39,42 {_DARK}",
        size=(480, 380),
        depth=True,
    ),
    Entry(
        "galaxy",
        "Maximum intensity projection, through the colours of a transfer function.",
        "galaxy",
        "--mode mip --classification post --eye 160,-260,310 --target 95.5,95.5,23.5 --height 138",
        {
            "points": [
                _point(0.03, (0.000, 0.000, 0.000), 1),
                _point(0.17, (0.006, 0.012, 0.070), 1),
                _point(0.34, (0.080, 0.030, 0.260), 1),
                _point(0.50, (0.500, 0.090, 0.220), 1),
                _point(0.68, (1.000, 0.420, 0.120), 1),
                _point(0.95, (1.000, 0.920, 0.700), 1),
            ]
        },
        size=(480, 350),
    ),
    Entry(
        "cloud",
        "Shadows: sunlight on a cloud, and a little of the sky's. There is no surface; all form is in the shadows.",
        "cloud",
        "--classification post --light -0.8,-0.55,0.8:1.2,1.05,0.9 --light head:0.08,0.1,0.14 --shadows --fade 1 "
        "--ambient 0.3 --specular 0 --background 0.13,0.27,0.52 --eye 150,-500,44 --target 54,55,52 --height 88",
        {"points": [_point(0, (0.96, 0.96, 0.97), 0), _point(0.4, (0.96, 0.96, 0.97), 0.5)]},
        size=(480, 420),
    ),
)

ENTRIES: dict[str, Entry] = {entry.name: entry for entry in (*_REAL, *_BUILT_IN)}
