"""Sound pictures, meshes, and texts (transfer functions, scenes, headers, limits and so on) for `fuzz.py`."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from support.fuzzing.seeds import VALUES, Seed, written
from texvol.formats.pictures import image
from texvol.formats.pictures.scene_metadata import ATTRIBUTE, scene_metadata
from texvol.geometry import Mesh
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

MEDIUM = TransferFunction([0.0, 20.0, 20.0, 60.0], np.full((4, 3), (0.9, 0.5, 0.1)), [0.0, 0.1, 0.2, np.inf])
_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
_FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def seeds() -> Iterator[Seed]:
    """All of them."""
    yield from _pictures()
    yield from _meshes()
    yield _font()
    for text in _TRANSFERS:
        yield _text("transfer", "t.json", json.dumps(text), "transfer")
    yield Seed("scene", {"s.toml": _SCENE.encode(), **_BESIDE()}, "s.toml", "scene", text=True)
    yield Seed("scene", {"s.toml": _MODES.encode(), **_BESIDE()}, "s.toml", "scene", text=True)
    for scene in _scenes():
        yield _text("header", "h.json", _header(scene), "header")
    for text in ('base = "two-drivers"\nmax-abs = 0.01\nfail-percent = 1.5\nhard-max = 0.5\n', _LIMITS):
        yield _text("limits", "l.toml", text, "limits")
    yield _text("transform", "t.txt", "# moved\n1 0 0 5\n0 0.8 -0.6 1e1\n0, 0.6, 0.8, -2.5\n0 0 0 1\n", "transform")
    yield _text("transform", "t.txt", "1 0 0 5\n0 1 0 0\n0 0 1 0\n", "transform")
    yield _text("script", "w.txt", _SCRIPT, "script")
    yield _text("recent", "recent.json", json.dumps(_RECENT), "recent")


def _text(kind: str, name: str, text: str, reader: str) -> Seed:
    return Seed(kind, {name: text.encode()}, name, reader, text=True)


def _font() -> Seed:
    import matplotlib

    # The smallest font that there is for sure; some of its letters are what a text of numbers needs.
    path = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "cmtt10.ttf"
    return Seed("font", {"f.ttf": path.read_bytes()}, "f.ttf", "font")


def _pictures() -> Iterator[Seed]:
    import tifffile

    pixels = np.linspace(0, 1, 6 * 5 * 4, dtype=np.float32).reshape(5, 6, 4)
    scene = next(iter(_scenes()))
    metadata = {ATTRIBUTE: _header(scene), "texvol:renderer": "llvmpipe", "texvol:fingerprint": '{"a": "b"}'}
    for name, transparent in (("p.exr", False), ("p.png", False), ("t.png", True), ("p.jpg", False)):
        content = image.encoded(name, pixels, metadata, transparent=transparent)
        yield Seed(f"picture-{name[2:]}", {name: content}, name, "picture")
    quick = image.encoded("q.png", pixels, metadata, quick=True)
    yield Seed("picture-png", {"q.png": quick}, "q.png", "picture")
    for name, kind, how in (("p.tif", "u1", {}), ("f.tif", "f4", {"compression": "zlib"}), ("h.tif", "u2", {})):
        values = (pixels * 200).astype(kind)
        content = written(name, lambda path, v=values, h=how: tifffile.imwrite(path, v, photometric="rgb", **h))
        yield Seed("picture-tif", {name: content}, name, "picture")
    for kind in ("half", "tiled", "parts"):
        yield Seed(
            "picture-exr", {"x.exr": written("x.exr", lambda path, k=kind: _write_exr(path, k))}, "x.exr", "picture"
        )


def _write_exr(path: object, kind: str) -> None:
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(20, 10, 4, oiio.HALF)
    spec.attribute("Compression", {"half": "piz", "tiled": "pxr24", "parts": "dwaa"}[kind])
    if kind == "tiled":
        spec.tile_width = spec.tile_height = 16
    spec.x, spec.full_width = (3, 30) if kind == "half" else (0, 20)
    output = oiio.ImageOutput.create("exr")
    output.open(str(path), spec)
    output.write_image(np.random.default_rng(1).random((10, 20, 4), np.float32))
    output.close()


def _meshes() -> Iterator[Seed]:
    from texvol.geometry import saving

    mesh = Mesh(_CORNERS, _FACES)
    for ending in ("ply", "stl", "obj", "vtp"):
        content = written(f"m.{ending}", lambda path: saving.save_mesh(mesh, path))
        yield Seed("mesh", {f"m.{ending}": content}, f"m.{ending}", "mesh", text=ending in ("obj", "vtp"))
    corners = "".join(f"{x} {y} {z} 0 0 1\n" for x, y, z in _CORNERS)
    faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in _FACES) + "4 0 1 2 3\n"
    named = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    head = "ply\nformat {} 1.0\ncomment made\nelement vertex 4\n" + named + "element face {}\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    yield _text("mesh", "a.ply", head.format("ascii", 5) + corners + faces, "mesh")
    for order, mark in (("little", "<"), ("big", ">")):
        data = b"".join(struct.pack(f"{mark}6f", *corner, 0, 0, 1) for corner in _CORNERS)
        data += b"".join(struct.pack(f"{mark}B3i", 3, *map(int, face)) for face in _FACES)
        files = {"b.ply": head.format(f"binary_{order}_endian", 4).encode() + data}
        yield Seed("mesh", files, "b.ply", "mesh")
    points = [["vertex {} {} {}".format(*_CORNERS[corner]) for corner in face] for face in _FACES]
    loops = ["facet normal 0 0 1\nouter loop\n" + "\n".join(each) + "\nendloop\nendfacet\n" for each in points]
    yield _text("mesh", "a.stl", "solid a\n" + "".join(loops) + "endsolid a\n", "mesh")
    lines = "# made\nmtllib m.mtl\no one\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in _CORNERS)
    lines += (
        "vt 0.5 0.5\nvn 0 0 1\ng group\nusemtl red\ns off\nf 1/1/1 2/1/1 3/1/1\nf 1//1 2//1 4//1 3//1\nf -1 -2 -3\n"
    )
    yield _text("mesh", "n.obj", lines, "mesh")


def _scenes() -> Iterator[Scene]:
    volume = Volume(VALUES, (1, 2, 3), name="v.npy", source={"path": "v.npy", "spacing": [1, 2, 3]})
    camera = Camera.perspective((20, -10, 15), volume.centre, (0, 0, 1), fov=35)
    lights = (Light(), Light("directional", (1, 2, 3)), Light("point", (3, 2, 1), (1, 0.9, 0.8)))
    lighting = Lighting(lights, shadows=True)
    clip = (ClipPlane((1, 0, 0), 1.0),)
    further = Volume(VALUES * 2, (2, 2, 2), name="w.npy", source={"path": "w.npy", "spacing": [2, 2, 2]})
    mask = Mask(VALUES / 60, "m.npy", {"path": "m.npy"})
    yield Scene(
        volume,
        MEDIUM,
        camera,
        lighting=lighting,
        clip=clip,
        crop=((0, 4), (0, 6), (0, 8)),
        mask=mask,
        classification="slab",
    )
    yield Scene(volume, MEDIUM, camera, added=(AddedVolume(further, MEDIUM),), classification="post")
    yield Scene(volume, None, camera, mode="isosurface", isovalue=20.5, depth_cue=DepthCue(0.5), classification="slab")


def _header(scene: Scene) -> str:
    settings = {"slab_thickness": 0.25}
    return scene_metadata("v.npy", scene, settings=settings, display={"window": (20, 40)}, checksum=True)[ATTRIBUTE]


def _BESIDE() -> dict[str, bytes]:
    """Files that the scenes name."""
    npy = written("v.npy", lambda path: np.save(path, VALUES))
    return {
        "v.npy": npy,
        "m.npy": written("m.npy", lambda path: np.save(path, VALUES / 60)),
        "t.json": json.dumps(_TRANSFERS[0]).encode(),
        "a.txt": b"1 0 0 5\n0 1 0 0\n0 0 1 0\n",
        "m.stl": b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
        b"endfacet\nendsolid a\n",
    }


_POINTS = [{"value": 0, "color": [0, 0, 0], "extinction": 0}, {"value": 30, "color": [0.9, 0.8, 0.7], "opacity": 0.5}]
_MATERIALS = [
    {"name": "fat", "from": [-150, -120], "to": [10, 20], "color": [0.9, 0.7, 0.1], "extinction": 0.02},
    {"name": "bone", "from": 20, "color": [1, 1, 0.9], "extinction": 0.4, "gradient": [0.1, 2]},
]
_TRANSFERS = (
    {"points": _POINTS, "values": "data", "length": "box", "emission": "associated"},
    {
        "materials": _MATERIALS,
        "show": ["bone"],
        "contours": [
            {"value": 12, "thickness": 2, "color": [0.8, 0.5, 0.4], "opacity": 0.9},
            {"value": 13, "world_thickness": 1.5, "material": "fat"},
        ],
        "boundaries": [{"materials": ["fat", "bone"], "gradient": 2}],
        "gradient": [[0, 0], [20, 1]],
        "gradients": "relative",
    },
    {
        "graded": [{"points": [{"value": 0, "emission": [0, 0, 0], "extinction": 0}, _POINTS[1]], "gradient": [1, 2]}],
        "points": [
            {"value": 0, "emission": [0, 1, 0], "extinction": 0},
            {"value": 1, "emission": [1, 0, 0], "extinction": 1},
        ],
        "emission": "emissive",
        "values": "range",
    },
    {"points": _POINTS, "values": "percentile", "material_names": ["a"], "material_colors": [[0, 1, 0]]},
)
_SCENE = """volume = "v.npy"
tf = "t.json"
projection = "perspective"
eye = [30, -20, 12]
target = "1,2,3"
up = [0, 0, 1]
fov = 35.5
size = "80x60"
spacing = [1, 2, 3]
light = ["head:0.5", {kind = "directional", direction = [-1, -1, 2], color = [1, 0.9, 0.8]}]
ambient = 0.2
shadows = true
two-sided = false
clip = ["1,0,0,0.5"]
crop = [0, 4, 0, 6, 0, 8]
caps = true
mask = {file = "m.npy", fade = [0, 1]}
background = "0.1,0.2,0.3"
[[add]]
file = "v.npy"
tf = "inferno"
transform = "a.txt"
spacing = [1, 1, 1]
"""
_MODES = """volume = "v.npy"
mode = "isosurface"
isovalue = 20.5
gradient = "gaussian:1.5"
depth-cue = 0.4
height = 12
mesh = ["m.stl:0.9,0.8,0.7:0.5"]
transform = [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0]]
annotate = ["box", "axes"]
title = "a title"
size = [80, 60]
"""
_LIMITS = "max-abs = 1e-3\noutlier = 0.25\nrms = inf\nflip = 0.05\n"
_SCRIPT = """# a script
{"t": 0.5, "kind": "move", "x": 200, "y": 300}
{"t": 0.6, "kind": "button", "name": "left", "down": true, "modifiers": ["shift"]}
{"t": 1.0, "kind": "resize", "x": 640, "y": 480}
{"t": 1.5, "kind": "drop", "names": ["a.npy", "b.npy"]}
{"t": 2.0, "do": "rest"}
{"t": 2.1, "do": "command", "name": "axis +x"}
{"t": 9.0, "do": "mark", "name": "end of the turn"}
"""
_RECENT = [
    "v.npy",
    {"path": "v.npy", "spacing": [1, 2, 3], "channel": 1, "add": [{"file": "v.npy", "spacing": [1, 2, 3]}]},
    {"path": "v.npy", "mask": {"file": "m.npy", "fade": [0, 1]}, "transform": [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0]},
]
