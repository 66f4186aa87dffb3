"""`--mesh` and `texvol surface`: meshes in and out on the command line, and in pictures that are drawn again."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from support.scenes import smooth_volume

from texvol import load
from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures import image
from texvol.geometry import Points, euler_number, load_mesh, surface_of
from texvol.geometry.extraction import SurfaceMethod, ambiguous_cell_count
from texvol.options.files import MeshChoice, mesh
from texvol.provenance.stored_scene import stored_scene_of
from texvol.rendering.renderer import Renderer
from texvol.util.errors import InputError

SURFACE = ["surface", "wavy.npy", "--value", "0.5", "-o"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with wavy.npy and its surface at a half, half.ply."""
    monkeypatch.chdir(tmp_path)
    np.save("wavy.npy", smooth_volume(20).values)
    assert main(["surface", "wavy.npy", "--value", "0.5", "-o", "half.ply"]) == 0
    return tmp_path


def render(*line: str) -> int:
    return main(["render", "wavy.npy", "--size", "40x30", "--tf", "fog", *line])


@pytest.mark.parametrize(
    ("text", "choice"),
    [
        ("a.ply", MeshChoice("a.ply")),
        ("a.ply:0.5", MeshChoice("a.ply", None, 0.5)),
        ("a.ply:1,0,.5", MeshChoice("a.ply", (1, 0, 0.5))),
        ("C:/x:y/a.ply:1,0,0:0.25", MeshChoice("C:/x:y/a.ply", (1, 0, 0), 0.25)),
    ],
)
def test_what_stands_behind_the_file_is_colour_and_opacity(text: str, choice: MeshChoice) -> None:
    assert mesh(text) == choice


def test_the_line_and_the_scene_file_mean_the_same(folder: Path) -> None:
    (folder / "sub").mkdir()
    (folder / "half.ply").rename(folder / "sub" / "half.ply")
    Path("sub/scene.toml").write_text(
        'volume = "../wavy.npy"\ntf = "fog"\nsize = "40x30"\n'
        'mesh = ["half.ply:0.1,0.5,0.9:0.5", {file = "half.ply", color = [1, 0, 0]}]\n'
    )
    assert render("--mesh", "sub/half.ply:0.1,0.5,0.9:0.5", "--mesh", "sub/half.ply:1,0,0", "-o", "line.exr") == 0
    assert main(["render", "--scene", "sub/scene.toml", "-o", "file.exr"]) == 0
    np.testing.assert_array_equal(image.read("line.exr"), image.read("file.exr"))
    assert render("-o", "plain.exr") == 0
    assert np.abs(image.read("line.exr") - image.read("plain.exr")).max() > 0.1


def test_a_picture_with_a_mesh_is_drawn_again_from_its_header(folder: Path) -> None:
    assert render("--mesh", "half.ply:0.1,0.5,0.9:0.5", "-o", "a.exr") == 0
    held = read_picture("a.exr")
    stored = stored_scene_of(held.attributes, name="a.exr", folder=folder)
    assert stored.scene.geometry[0].opacity == 0.5
    with Renderer() as renderer:
        np.testing.assert_array_equal(renderer.render(stored.scene, (40, 30), **stored.settings), held.pixels)
    other = load_mesh("half.ply")
    from texvol.geometry import save_mesh

    save_mesh(type(other)(other.vertices + 1, other.triangles), "half.ply")
    with pytest.raises(InputError, match=r"a\.exr.*half\.ply has changed"):
        stored_scene_of(held.attributes, name="a.exr", folder=folder)
    Path("half.ply").unlink()
    with pytest.raises(InputError, match=r"a\.exr.*half\.ply"):
        stored_scene_of(held.attributes, name="a.exr", folder=folder)


@pytest.mark.parametrize("name", ["s.ply", "s.stl", "s.obj", "s.vtp"])
def test_surfaces_are_written_in_every_format(folder: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["surface", "wavy.npy", "--value", "0.7", "-o", name]) == 0
    assert "triangles" in capsys.readouterr().out
    found = load_mesh(name)
    # Every corner lies where the linear field along its edge is 0.7; the mesh lies in the box.
    assert len(found.triangles) > 100
    assert found.vertices.min() >= -0.5 and found.vertices.max() <= 19.5


@pytest.mark.parametrize("method", ["marching-cubes", "marching-tetrahedra", "cuberille", "contours", "dividing-cubes"])
def test_each_method_writes_what_its_call_returns(
    folder: Path, method: SurfaceMethod, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["surface", "wavy.npy", "--value", "0.7", "--method", method, "-o", "s.vtp"]) == 0
    size, numbers = capsys.readouterr().out.splitlines()
    volume = load("wavy.npy")
    wanted = surface_of(volume, 0.7, method)
    ambiguous = f"{ambiguous_cell_count(volume, 0.7)} ambiguous cells"
    if isinstance(wanted, Points):
        assert size == f"{folder / 's.vtp'}: {len(wanted.points)} points"
        assert numbers == f"{method}: {ambiguous}"
    else:
        found = load_mesh("s.vtp")
        np.testing.assert_array_equal(found.vertices, wanted.vertices)
        np.testing.assert_array_equal(found.triangles, wanted.triangles)
        closed = "closed" if method == "contours" else "open"
        assert numbers == f"{method}: Euler number {euler_number(wanted)}, {closed}, {ambiguous}"


def test_the_size_of_parts_is_passed_on(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for size in ("1", "0.25"):
        line = ["surface", "wavy.npy", "--value", "0.7", "--method", "dividing-cubes", "--cell-size", size]
        assert main([*line, "-o", "p.ply"]) == 0
    few, many = (int(number) for number in re.findall(r"(\d+) points", capsys.readouterr().out))
    # 16 times as many, but for cells in which the surface bends.
    assert many == pytest.approx(16 * few, rel=0.25)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (["render", "wavy.npy", "-o", "a.png", "--mesh", "gone.ply"], "gone.ply"),
        (["render", "wavy.npy", "-o", "a.png", "--mesh", "wavy.npy"], "wavy.npy"),
        (["render", "wavy.npy", "-o", "a.png", "--mesh", "half.ply:2,0,0"], "[0, 1]"),
        (["render", "wavy.npy", "-o", "a.png", "--mesh", "half.ply:0"], "opacity"),
        (["render", "wavy.npy", "-o", "a.png", "--mesh", "half.ply", "--mode", "mip"], "mip"),
        (["surface", "wavy.npy", "--value", "7", "-o", "a.ply"], "from 0"),
        (["surface", "wavy.npy", "--value", "nan", "-o", "a.ply"], "finite"),
        (["surface", "wavy.npy", "--value", "0.5", "-o", "a.png"], ".ply, .stl, .obj or .vtp"),
        (["surface", "wavy.npy", "-o", "a.ply"], "--value"),
        ([*SURFACE, "a.ply", "--method", "cubes"], "--method"),
        ([*SURFACE, "a.stl", "--method", "dividing-cubes"], "a.stl: STL holds triangles only"),
        ([*SURFACE, "a.ply", "--cell-size", "1"], "--cell-size is for --method dividing-cubes only"),
        ([*SURFACE, "a.ply", "--method", "dividing-cubes", "--cell-size", "0"], "--cell-size must be"),
        ([*SURFACE, "a.ply", "--method", "dividing-cubes", "--cell-size", "nan"], "--cell-size must be"),
        ([*SURFACE, "a.ply", "--method", "dividing-cubes", "--cell-size", "1e-6"], "cell_size must make at most"),
        (["surface", "gone.npy", "--value", "0.5", "-o", "a.ply"], "gone.npy"),
    ],
)
def test_wrong_usage_is_one_line(folder: Path, line: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(line) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1
    assert {path.name for path in folder.iterdir()} == {"wavy.npy", "half.ply"}
