"""Geometry in a scene: what cuts it, which modes show it, what is refused; and where there is none it costs nothing."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.quick_stats import quick_stats
from support.scenes import BONE, constant, random_volume, smooth_volume
from support.shader_programs import LIGHTS
from support.shapes import Quad, box_ends, fog_between, hits_of, quad

from texvol import Camera, ClipPlane, InputError, Light, Lighting, Renderer, Scene, TransferFunction, Volume, raycast
from texvol.geometry import Lines
from texvol.opengl.contexts import Context
from texvol.opengl.shaders import FOLDER, load_compute, load_program
from texvol.opengl.uniforms import NO_LIGHT
from texvol.rendering.modelled import modelled

SIZE = (48, 44)
COLOR = (0.9, 0.6, 0.3)
VOLUME = random_volume(5, (13, 9, 14))
CAMERA = Camera.framing(VOLUME, "perspective", eye=VOLUME.centre + VOLUME.radius * np.array([1.5, -2.0, 1.2]))


def walls() -> list[Quad]:
    """A translucent and an opaque one, larger than the box."""
    c, r = VOLUME.centre, VOLUME.radius
    return [
        quad(c + (0.1 * r, 0, 0), (0, 2 * r, 0.3 * r), (0.5 * r, 0, 2 * r), (0.1, 0.9, 0.2), 0.5),
        quad(c - (0.1 * r, 0, 0), (0.3 * r, 0.5 * r, 0), (0, -0.2 * r, 0.6 * r), (0.2, 0.3, 1), 1.0),
    ]


@pytest.mark.parametrize("how, caps", [("planes", True), ("crop", False)])
def test_what_cuts_matter_cuts_geometry_unless_it_is_not_to(renderer: Renderer, how: str, caps: bool) -> None:
    c, r = VOLUME.centre, VOLUME.radius
    normals = np.array([(-1, 0.3, 0.1), (0.2, -0.1, -1)] if how == "planes" else [*np.eye(3), *-np.eye(3)])
    offsets = normals @ c - 0.3 * r
    cutting: dict[str, Any] = {"crop": [(x - 0.3 * r, x + 0.3 * r) for x in c]}
    if how == "planes":
        cutting = {"clip": tuple(ClipPlane(tuple(n), float(d)) for n, d in zip(normals, offsets, strict=True))}
    eyes, directions = CAMERA.rays(SIZE)
    rise = directions @ normals.T
    t = (offsets - eyes @ normals.T) / rise
    kept = np.where(rise > 0, t, -np.inf).max(axis=-1), np.where(rise < 0, t, np.inf).min(axis=-1)
    first, last = box_ends(VOLUME, eyes, directions)
    ends = np.maximum(first, kept[0]), np.minimum(last, kept[1])
    cap = np.where((kept[0] > first) & (kept[0] < last) & (kept[0] < kept[1]), kept[0], np.inf)
    for is_cut in (True, False):
        surfaces = []
        for each in walls():
            at = hits_of(each, eyes, directions)
            inside = (kept[0] <= at) & (at <= kept[1])
            surfaces.append((np.where(inside | (not is_cut), at, np.inf), (*each.color, each.opacity)))
        if caps:
            surfaces.append((cap, (*COLOR, 1.0)))
        exact = fog_between(COLOR, 0.3, ends, surfaces)
        scene = Scene(
            VOLUME,
            constant(0.3, COLOR),
            CAMERA,
            geometry=[each.mesh(cut=is_cut) for each in walls()],
            caps=caps,
            classification="slab",
        )
        scene = replace(scene, **cutting)
        assert np.abs(renderer.render(scene, SIZE) - exact).max() < 2e-6
        assert np.abs(raycast(scene, SIZE) - exact).max() < 1e-12
        bare = raycast(replace(scene, geometry=()), SIZE)
        is_seen = (np.abs(bare - exact).max(axis=-1) > 0.05).mean()
        assert is_seen > 0.02 or (caps and is_cut), "caps hide what is cut as they are"


def test_no_cap_lies_behind_a_surface(renderer: Renderer) -> None:
    """The planes cut through emptiness; where a ray leaves a pane of glass behind, matter begins that is not cut."""
    values = np.zeros((14, 9, 13))
    values[:, 6:] = 1
    volume = Volume(values, VOLUME.spacing)
    transfer = TransferFunction(np.array([0.5, 0.5]), np.array([COLOR] * 2), np.array([0.0, 0.3]))
    pane = quad(volume.centre + (0, 3.0, 0), (9, 0, 0), (0, 0.5, 9), opacity=0.4)
    scene = Scene(
        volume,
        transfer,
        CAMERA,
        geometry=(pane.mesh(),),
        clip=(ClipPlane((0, 1, 0), 3.0),),
        caps=True,
        classification="slab",
    )
    for classification in ("post", "integrated"):
        scene = replace(scene, classification=classification)
        truth = raycast(scene, SIZE)
        np.testing.assert_array_equal(truth, raycast(replace(scene, caps=False), SIZE))
        # Slabs are off by the part of one in which matter begins.
        assert np.abs(renderer.render(scene, SIZE, sampling_rate=16) - truth).max() < 0.3 * 0.7 / 16 * 2


def test_lines_are_cut_where_they_are(renderer: Renderer) -> None:
    c, r = VOLUME.centre, VOLUME.radius
    points = c + r * np.random.default_rng(8).uniform(-1, 1, (12, 3))
    lines = Lines(points, [range(12)], (1, 1, 1), 0.5, 4.0)
    scene = Scene(
        VOLUME,
        constant(0.1, COLOR),
        CAMERA,
        geometry=(lines,),
        clip=(ClipPlane((1, 0.2, 0), float(c[0])),),
        classification="slab",
    )
    assert np.abs(renderer.render(scene, SIZE) - raycast(scene, SIZE)).max() < 2e-6
    uncut = raycast(replace(scene, geometry=(replace(lines, cut=False),)), SIZE)
    assert (np.abs(uncut - raycast(scene, SIZE)).max(axis=-1) > 0.1).mean() > 0.02


@pytest.mark.parametrize("lighting", [None, Lighting((Light("point", (3, -9, 11)),))])
def test_an_isosurface_stands_among_geometry(renderer: Renderer, lighting: Lighting | None) -> None:
    """In front of it, behind it, and through it; the background comes last."""
    volume = smooth_volume(33)
    c, r = volume.centre, volume.radius
    camera = Camera.framing(volume, "perspective", eye=c + r * np.array([1.5, -2.0, 1.2]))
    quads = [
        quad(c, (0.6 * r, 0, 0.1 * r), (0, 0.1 * r, 0.6 * r), (0.1, 0.9, 0.2), 0.5),
        quad(c, (0, 0.6 * r, 0.1 * r), (0.1 * r, 0, 0.5 * r), (0.2, 0.3, 1), 1.0),
    ]
    scene = Scene(
        volume, BONE, camera, (0.2, 0.1, 0.4), mode="isosurface", isovalue=0.6, lighting=lighting, classification="slab"
    )
    bare = raycast(scene, SIZE)
    scene = replace(scene, geometry=tuple(each.mesh() for each in quads))
    picture, truth = renderer.render(scene, SIZE, sampling_rate=4), raycast(scene, SIZE)
    off = np.abs(picture - truth).max(axis=-1)
    # Where a ray just meets the surface float32 decides otherwise: in few pixels.
    assert (off < 2e-5).mean() > 0.995
    # The same by hand: the surface at its depth, opaque, among the quads.
    from texvol.ray_casting.projection import isosurface_depth

    eyes, directions = camera.rays(SIZE)
    at = isosurface_depth(scene, SIZE) / (directions @ camera.forward)
    surfaces: list[tuple[Any, Any]] = [(hits_of(each, eyes, directions), (*each.color, each.opacity)) for each in quads]
    surfaces.append((at, np.concatenate([bare[..., :3], np.ones((*at.shape, 1))], axis=-1)))
    exact = fog_between(COLOR, 0.0, (np.zeros(at.shape), np.zeros(at.shape)), surfaces)
    exact[..., :3] += (1 - exact[..., 3:]) * np.array(scene.background)
    np.testing.assert_allclose(truth, exact, atol=1e-9)
    met, quads_met = np.isfinite(at), np.isfinite(surfaces[1][0])
    assert (met & quads_met & (at < surfaces[1][0])).mean() > 0.02 < (met & quads_met & (at > surfaces[1][0])).mean()
    # Its depth is its own, whatever stands in front.
    depth = renderer.depth()
    assert (np.isfinite(depth) == met).mean() > 0.999
    np.testing.assert_allclose(
        depth[met & np.isfinite(depth)], isosurface_depth(scene, SIZE)[met & np.isfinite(depth)], rtol=1e-4
    )


@pytest.mark.parametrize("mode", ["xray", "mip", "minip", "average"])
def test_pictures_of_numbers_have_no_place_for_geometry(mode: Any) -> None:
    with pytest.raises(InputError, match=f"geometry .* {mode}"):
        Scene(VOLUME, mode=mode, geometry=(walls()[0].mesh(),), classification="slab")


@pytest.mark.parametrize("wrong", [[1], "mesh", [(0, 1, 2)], 3])
def test_other_things_are_no_geometry(wrong: Any) -> None:
    with pytest.raises(InputError, match="each of geometry must be a Mesh or Lines, got "):
        Scene(VOLUME, geometry=wrong, classification="slab")


def test_a_single_mesh_is_geometry_too() -> None:
    mesh = walls()[0].mesh()
    assert Scene(VOLUME, geometry=mesh, classification="slab").geometry == (mesh,)  # type: ignore[arg-type]
    assert (
        Scene(VOLUME, geometry=[mesh], classification="slab")
        == Scene(VOLUME, geometry=(mesh,), classification="slab")
        != Scene(VOLUME, classification="slab")
    )
    assert Scene(VOLUME, geometry=(replace(mesh),), classification="slab") != Scene(
        VOLUME, geometry=(mesh,), classification="slab"
    ), "another object is another"
    assert hash(mesh) == hash(mesh) != hash(replace(mesh))


def test_a_picture_without_volume_in_it_still_has_its_geometry(renderer: Renderer) -> None:
    """Matter that shows nothing: no brick is drawn, and the surface is."""
    wall = walls()[1]
    eyes, directions = CAMERA.rays(SIZE)
    scene = Scene(VOLUME, constant(0.0), CAMERA, geometry=(wall.mesh(),), classification="slab")
    expected = np.where(np.isfinite(hits_of(wall, eyes, directions))[..., np.newaxis], (*wall.color, 1.0), 0.0)
    np.testing.assert_allclose(renderer.render(scene, SIZE), expected, atol=1e-7)
    assert quick_stats(renderer)["bricks_drawn"] == 0
    away = replace(scene, geometry=(replace(scene.geometry[0], vertices=scene.geometry[0].vertices + 1e6),))
    assert not renderer.render(away, SIZE).any()


def test_a_renderer_goes_from_one_scene_to_another(renderer: Renderer) -> None:
    """Other shapes, sizes and cameras; no geometry in between leaves the picture as it was."""
    scene = Scene(VOLUME, constant(0.2, COLOR), CAMERA, classification="slab")
    plain = renderer.render(scene, SIZE)
    one = replace(scene, geometry=(walls()[0].mesh(),))
    two = replace(scene, geometry=(walls()[1].mesh(), Lines(VOLUME.corners_from_centre, [range(8)])))
    closer = replace(one, camera=Camera.framing(VOLUME, "orthographic"))
    for each, size in ((one, SIZE), (two, SIZE), (one, (31, 90)), (closer, SIZE), (one, SIZE)):
        assert np.abs(renderer.render(each, size) - raycast(each, size)).max() < 2e-6
    np.testing.assert_array_equal(renderer.render(scene, SIZE), plain)


def test_stats_count_what_is_sampled_in_front_of_surfaces(renderer: Renderer) -> None:
    c, r = VOLUME.centre, VOLUME.radius
    scene = Scene(VOLUME, constant(1e-3, COLOR), CAMERA, classification="slab")
    renderer.render(scene, SIZE)
    whole = quick_stats(renderer, samples=True)["samples"]
    toward = (np.array(CAMERA.eye) - c) / np.linalg.norm(np.array(CAMERA.eye) - c)
    screen = quad(c + 1.1 * r * toward, 3 * r * CAMERA.right, 3 * r * CAMERA.upward, opacity=1.0)
    renderer.render(replace(scene, geometry=(screen.mesh(),)), SIZE)
    assert quick_stats(renderer, samples=True)["samples"] == 0 < whole
    middle = replace(scene, geometry=(quad(c, 3 * r * CAMERA.right, 3 * r * CAMERA.upward, opacity=1.0).mesh(),))
    renderer.render(middle, SIZE)
    assert 0.3 < quick_stats(renderer, samples=True)["samples"] / whole < 0.7
    assert 0 <= renderer.stats["estimated_error"] < 1e-4
    glass = replace(middle, geometry=(replace(middle.geometry[0], opacity=0.5),))
    renderer.render(glass, SIZE)
    # Each ray has one end slab more on either side of it.
    assert whole <= quick_stats(renderer, samples=True)["samples"] < 1.2 * whole


MODELLED = {
    "nothing": ((), []),
    "unlit mesh": ((walls()[1].mesh(),), ["geometry"]),
    "lit": ((walls()[1].mesh(lit=True),), ["geometry", "head light on geometry"]),
    "translucent": ((walls()[0].mesh(),), ["geometry", "translucent geometry"]),
    "lines": ((Lines([(0, 0, 0), (1, 1, 1)], [(0, 1)]),), ["lines"]),
}


@pytest.mark.parametrize("name", MODELLED)
def test_what_is_modelled_is_said_and_no_more(name: str) -> None:
    geometry, expected = MODELLED[name]
    scene = Scene(VOLUME, constant(0.2), CAMERA, geometry=geometry, classification="slab")
    assert sorted(modelled(scene.completed((8, 8)))) == sorted(["perspective", *expected])
    lit = replace(scene, lighting=Lighting())
    assert "head light on geometry" not in modelled(lit.completed((8, 8)))


def test_no_geometry_imports_compiles_and_allocates_nothing(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np, texvol\n"
        "renderer = texvol.Renderer()\n"
        "for mode, value in (('composite', None), ('isosurface', 0.5)):\n"
        "    scene = texvol.Scene(texvol.Volume(np.random.rand(5, 5, 5)), mode=mode, isovalue=value)\n"
        "    renderer.render(scene, (8, 8))\n"
        "    renderer.stats['estimated_error']\n"
        "    assert renderer._pictures.in_memory.cache._surfaces is None\n"
        "    assert all(not dict(key[1:])['INTERVAL'] for key in renderer._compositor._programs.kept)\n"
        "    texvol.raycast(scene, (4, 4))\n"
        "print(*sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = set(done.stdout.split())
    assert "texvol.scene.shapes" in loaded, "names are those that are looked for"
    costly = {
        "texvol.opengl.surfaces.surfaces",
        "texvol.opengl.surfaces.on_screen",
        "texvol.ray_casting.surfaces",
        "trimesh",
        "skimage",
    }
    assert not loaded & (costly | {"texvol.ray_casting.surfaces.hits", "texvol.geometry.reading"})


def test_what_the_shapes_do_without_is_not_compiled(renderer: Renderer) -> None:
    with Renderer() as fresh:
        fresh.render(Scene(VOLUME, constant(0.2), CAMERA, geometry=(walls()[0].mesh(),), classification="slab"), SIZE)
        surfaces = fresh._pictures.in_memory.cache._surfaces
        assert surfaces is not None
        [switches] = [dict(key[1:]) for key in surfaces._programs.kept if key[0] == "surface"]
    assert {name for name, value in switches.items() if value} == {"PERSPECTIVE"}


@pytest.mark.parametrize("lights", [{}, *LIGHTS[1:]], ids=str)
def test_every_combination_of_switches_compiles(context: Context, lights: dict[str, int]) -> None:
    if lights.get("SHADOWS"):
        return  # none falls on surfaces
    # Each pair of values of two switches.
    pairs = [(0, 0, 0, 0), (0, 1, 1, 1), (1, 0, 1, 0), (1, 1, 0, 1), (7, 0, 0, 1), (7, 1, 1, 0)]
    for planes, direction, lines, cue in pairs:
        switches = {"PERSPECTIVE": direction, "HALF_SPACES": planes, "LINES": lines, "CUE": cue, "FETCHED": 0}
        load_program(context.gl, "surface", defines=NO_LIGHT | lights | switches)
        load_program(context.gl, "surface_next", defines=NO_LIGHT | lights | switches, vertex="corner.vert")
        of_hits = {
            name: (NO_LIGHT | lights | switches)[name] for name in ("LIT", "PERSPECTIVE", "HALF_SPACES", "LINES")
        }
        load_compute(context.gl, "surface_hits", defines=of_hits | {"POINT_LIGHTS": 0})
    load_program(context.gl, "texels", vertex="corner.vert")


@pytest.mark.parametrize("name", ["slab_stack", "projection"])
def test_every_stretch_compiles(context: Context, name: str) -> None:
    from texvol.opengl.uniforms import NOTHING_SPECIAL

    for direction, planes, bricks in [(0, 0, 0), (1, 2, 0), (1, 0, 1), (0, 2, 1)]:  # each pair
        common = {
            "PERSPECTIVE": direction,
            "HALF_SPACES": planes,
            "BRICKS": bricks,
            "INTERVAL": 1,
            "SKIPS": 1,
            "FETCHED": 0,
        }
        common |= {"CUE": 0, "COUNT": 0}
        if name == "projection":
            medium = [{"MODE": 3, "DEPTH": 0, "MISSING": 0, "KNOWN": 0, "WEIGHTS": 0, "GRADIENT": 1}]
        else:
            medium = [
                NOTHING_SPECIAL | {"CLASSIFICATION": kind, "CAPS": int(planes > 0), "AT_ONCE": 2, "DIVIDES": 0}
                for kind in range(4)
            ]
        for each in medium:
            load_program(context.gl, name, defines=NO_LIGHT | common | each, vertex="slab_stack.vert")


def test_drivers_without_double_precision_draw_it_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Places are then known to float32 alone: a few 2^-23 of the box, in which the optical depth is 8 at most."""
    for file in FOLDER.iterdir():
        (tmp_path / file.name).write_text(file.read_text().replace("#ifdef GL_ARB_gpu_shader_fp64", "#if 0"))

    def load(gl: Any, name: str, **more: Any) -> Any:
        return load_program(gl, name, **(more | {"folder": tmp_path}))

    monkeypatch.setattr("texvol.opengl.shaders.load_program", load)
    lines = Lines(VOLUME.corners_from_centre + VOLUME.centre, [range(8)], opacity=0.5, width=3)
    scene = Scene(
        VOLUME,
        constant(0.4, COLOR),
        CAMERA,
        geometry=(*(each.mesh(lit=True) for each in walls()), lines),
        classification="slab",
    )
    with Renderer() as opened:
        assert np.abs(opened.render(scene, SIZE) - raycast(scene, SIZE)).max() < 5 * 8 * 2.0**-23


def test_the_other_back_end_draws_the_same(backend: str) -> None:
    scene = Scene(
        VOLUME,
        constant(0.2, COLOR),
        CAMERA,
        geometry=tuple(each.mesh(lit=True) for each in walls()),
        classification="slab",
    )
    with Renderer(backend) as opened:
        assert np.abs(opened.render(scene, SIZE) - raycast(scene, SIZE)).max() < 2e-6
