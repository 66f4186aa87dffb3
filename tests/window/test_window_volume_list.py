"""The list of volumes: each can be hidden, coloured, moved, taken as labels or out, the first one as well."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support import panel_frames
from support.desks import SIZE, desk_with, done, said
from support.large import large
from support.raised import raised
from support.windows import ball, eight_bits, texvol

import texvol as package
from texvol import Renderer, Scene
from texvol.formats.pictures import image
from texvol.formats.readers import load
from texvol.scene import transfer
from texvol.scene.lighting import Lighting
from texvol.scene.spaces import turned
from texvol.scene.volume import Volume
from texvol.scene.volume_order import CLEAR
from texvol.util.errors import InputError
from texvol.window import list_editing, placing, recent, saving, tinting
from texvol.window.document import Document, opened_file
from texvol.window.stand_in import StandIn, stand_in

MOVE = np.array([[0, -1, 0, 4], [1, 0, 0, -2], [0, 0, 1, 1], [0, 0, 0, 1.0]])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Volumes of several worlds, an image of channels, and a matrix."""
    import nrrd
    import tifffile

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    ball(tmp_path, 16)
    rng = np.random.default_rng(3)
    for name, space in (("lps", "left-posterior-superior"), ("ras", "right-anterior-superior")):
        head = {"space": space, "space directions": np.diag([1.0, 2.0, 1.5]), "space origin": [5.0, -3.0, 2.0]}
        nrrd.write(f"{name}.nrrd", rng.integers(0, 200, (7, 8, 9)).astype(np.uint8), head)
    channels = rng.integers(0, 200, (5, 6, 8, 9)).astype(np.uint8)
    names = {"axes": "CZYX", "Channel": {"Name": [f"stain {n}" for n in range(5)]}}
    tifffile.imwrite("cell.ome.tif", channels, ome=True, photometric="minisblack", metadata=names)
    np.savetxt("move.txt", MOVE)
    return tmp_path


def places(document: Document) -> list[np.ndarray]:
    """Corner and axes of each volume of the list."""
    found = [each.owner.volume for each in list_editing.entries(document)]
    return [np.column_stack([volume.origin, volume.world_from_index]) for volume in found]


def eyes(document: Document) -> list[bool]:
    return [each.shown for each in list_editing.entries(document)]


def names(document: Document) -> list[str]:
    return [Path(each.owner.volume.name).name for each in list_editing.entries(document)]


def test_every_volume_can_be_hidden_and_shown(folder: Path) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd", "add ball.npy")
    whole, before = document.scene, places(document)
    for number, shown, is_clear in ((2, 2, False), (1, 1, False), (3, 1, True)):
        done(desk, f"eye {number}")
        assert not said(desk)
        assert len(document.scene.volumes) == shown and (document.scene.transfer_function is CLEAR) == is_clear
    assert eyes(document) == [False] * 3 and names(document) == ["lps.nrrd", "ras.nrrd", "ball.npy"]
    assert_array_equal(places(document), before)
    for number in (3, 1, 2):
        done(desk, f"eye {number}")
    assert eyes(document) == [True] * 3
    assert document.scene.volumes == whole.volumes
    assert document.scene.transfer_function is whole.transfer_function
    done(desk, *["undo"] * 6)
    assert document.scene.added == whole.added and len(document.history.past) == 2


def test_one_volume_of_many_is_shown_alone_and_all_again(folder: Path) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd", "add ball.npy", "eye 1", "solo 2")
    assert eyes(document) == [False, True, False]
    done(desk, "solo 3")
    assert eyes(document) == [False, False, True]
    done(desk, "solo 3")
    assert eyes(document) == [True, True, True]
    done(desk, "undo", "undo", "undo")
    assert eyes(document) == [False, True, True], "each is one step"
    done(desk, "eye 1")
    desk.change(mode="isosurface", isovalue=20.0, transfer_function=None, added=(), lighting=None)
    desk.messages.clear()
    done(desk, "solo 1")
    assert not said(desk), "it is alone"


def test_what_is_hidden_is_not_drawn_and_not_sent(folder: Path, renderer: Renderer) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd", "eye 1")
    alone = replace(document.scene, added=())
    assert document.scene.volumes == (list_editing.entries(document)[1].owner.volume,)
    assert_array_equal(renderer.render(document.scene, SIZE), renderer.render(alone, SIZE))
    done(desk, "eye 2")
    assert not renderer.render(document.scene, SIZE).any()


@pytest.mark.parametrize("other", ["ras.nrrd", "ball.npy"])
def test_the_first_can_go_and_all_else_stays_where_it_is(folder: Path, renderer: Renderer, other: str) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, f"add {other}", "add ras.nrrd", "eye 2", "eye 2")
    before = places(document)
    looked = document.view.camera
    done(desk, "remove 1")
    assert names(document) == [other, "ras.nrrd"] and not said(desk)
    assert_array_equal(places(document), before[1:])
    document.scene = replace(document.scene, camera=looked)
    picture = renderer.render(document.scene, SIZE)
    assert picture.any()
    saving.save_scene("saved.toml", document, SIZE)
    again = opened_file("saved.toml", SIZE)
    assert_allclose(places(again), before[1:], atol=1e-12)
    assert again.scene.volume.space == document.scene.volume.space
    assert_allclose(renderer.render(again.scene, SIZE), picture, atol=1e-6)
    done(desk, "undo")
    assert names(document) == ["lps.nrrd", other, "ras.nrrd"]
    assert_array_equal(places(document), before)


def test_the_only_volume_stays(folder: Path) -> None:
    desk = desk_with("ball.npy")
    document = done(desk, "remove 1")
    assert "the only volume" in said(desk) and len(document.scene.volumes) == 1
    desk.change(mode="mip")
    desk.messages.clear()
    done(desk, "eye 1")
    assert "mode composite" in said(desk) and eyes(document) == [True]


def test_a_hidden_volume_takes_the_place_of_the_only_shown_one(folder: Path) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd", "eye 2")
    desk.change(mode="mip", transfer_function=None, lighting=None)
    done(desk, "remove 1")
    assert names(document) == ["ras.nrrd"] and eyes(document) == [True] and not said(desk)


def test_scene_files_keep_what_is_hidden(folder: Path) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd", "add ball.npy", "opacity 2 0.25", "eye 1", "eye 3")
    assert document.unsaved
    before = places(document)
    done(desk, "save kept.toml")
    assert not document.unsaved
    text = (folder / "kept.toml").read_text()
    assert text.count("hidden = true") == 2
    again = opened_file("kept.toml", SIZE)
    assert eyes(again) == [False, True, False] and names(again) == names(document) and not again.unsaved
    assert_allclose(places(again), before, atol=1e-12)
    for one, other in zip(list_editing.entries(document), list_editing.entries(again), strict=True):
        assert one.owner.medium.as_json() == other.owner.medium.as_json()
    done(desk, "remove 3")
    assert document.unsaved, "the file would be another one"


def test_a_scene_with_hidden_volumes_is_drawn_headless_without_reading_them(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd", "eye 2", "save kept.toml")
    monkeypatch.setattr("texvol.options.volumes.AddedChoice.load", lambda _: pytest.fail("a hidden volume was read"))
    texvol(folder, "render", "--scene", "kept.toml", "--sampling-rate", "1", "-o", "kept.png")
    with package.Renderer() as drawing:
        wanted = drawing.render(document.scene, SIZE, sampling_rate=1)
    assert eight_bits(folder / "kept.png").any() and wanted.any()


@pytest.mark.parametrize("hidden", [[1], [2], [1, 2]])
def test_render_draws_what_the_window_shows(folder: Path, hidden: list[int]) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd", *(f"eye {number}" for number in hidden), "save kept.toml")
    texvol(folder, "render", "--scene", "kept.toml", "--sampling-rate", "1", "-o", "kept.exr")
    with package.Renderer() as drawing:
        wanted = drawing.render(document.scene, SIZE, sampling_rate=1)
    assert_array_equal(image.read(folder / "kept.exr"), wanted)
    assert wanted.any() == (len(hidden) < 2)


def test_opacity_and_colour_are_of_the_function_before(folder: Path) -> None:
    desk = desk_with("ball.npy")
    document = desk.document
    assert document is not None
    own = document.scene.transfer_function
    assert own is not None
    done(desk, "opacity 1 0.5", "color 1 #00ff00", "opacity 1 2")
    medium = document.scene.transfer_function
    assert medium is not None
    assert_allclose(medium.extinctions, 2 * own.extinctions)
    assert not medium.colors[:, [0, 2]].any() and medium.colors[:, 1].max() == 1
    assert_allclose(medium.colors[:, 1], own.colors.max(axis=1) / own.colors[own.extinctions > 0].max(), atol=1e-12)
    tint = tinting.tint_of(medium)
    assert (tint.base, tint.color, tint.opacity) == (own, (0.0, 1.0, 0.0), 2.0)
    done(desk, "undo", "undo")
    assert tinting.tint_of(document.scene.transfer_function).opacity == 0.5  # type: ignore[arg-type]
    done(desk, "color 1 none", "opacity 1 1")
    assert document.scene.transfer_function is own, "back to what it was"


@pytest.mark.parametrize("name", ["ct-materials", "boundaries", "contours", "viridis", "fluorescence"])
def test_every_kind_of_function_takes_one_hue(name: str) -> None:
    rng = np.random.default_rng(2)
    volume = Volume(rng.integers(0, 255, (12, 12, 12)).astype(np.uint8))
    medium = transfer.preset(name, volume)
    changed = tinting.tinted(medium, (0.5, 0.25, 0.0))
    values, magnitudes = rng.uniform(0, 255, 200), rng.uniform(0, 100, 200)
    emission, extinction = changed.classify(values, magnitudes)
    assert_array_equal(extinction, medium.classify(values, magnitudes).extinction)
    assert_allclose(emission[:, 0], 2 * emission[:, 1], atol=1e-9)
    assert not emission[:, 2].any() and emission.any()
    shown = np.array(tinting.brightest(changed))
    assert_allclose(shown / shown.max(), (1, 0.5, 0), atol=1e-9)


def test_spacing_and_transform_are_those_of_the_options(folder: Path) -> None:
    for name, spacing in (("ras.nrrd", (2.0, 0.5, 1.0)), ("ball.npy", (1.0, 3.0, 2.0))):
        desk = desk_with("lps.nrrd")
        words = ",".join(map(str, spacing))
        document = done(desk, f"add {name}", "transform 2 move.txt", f"spacing 2 {words}")
        found = document.scene.volumes[1]
        expected = load(name, spacing=spacing)
        expected = turned(expected, "left-posterior-superior").moved(MOVE)
        assert_allclose(found.world_from_index, expected.world_from_index, atol=1e-12)
        assert_allclose(found.origin, expected.origin, atol=1e-12)
        assert_allclose(placing.spacing_of(found), spacing, rtol=1e-9)
        assert_allclose(placing.transform_of(found), MOVE, atol=1e-12)
        assert found.values is list_editing.entries(document)[1].owner.volume.values
        saving.save_scene("saved.toml", document, SIZE)
        assert_allclose(places(opened_file("saved.toml", SIZE)), places(document), atol=1e-12)
        done(desk, "transform 2 none")
        plain = turned(load(name, spacing=spacing), "left-posterior-superior")
        assert_allclose(document.scene.volumes[1].origin, plain.origin, atol=1e-12)
        assert "transform" not in document.scene.volumes[1].source or name == "ras.nrrd"


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("spacing 1 1,0,1", "spacing must be positive"),
        ("spacing 1 1,1", "three numbers"),
        ("transform 1 none.txt", "none.txt"),
        ("transform 1 bad.txt", "bad.txt"),
        ("eye 3", "volume must be a number from 1 to 1, got '3'"),
        ("remove x", "volume must be a number"),
        ("color 1 blueish", "color must be"),
        ("opacity 1 -2", "opacity must be a factor"),
    ],
)
def test_what_can_not_be_done_is_said_and_changes_nothing(folder: Path, command: str, reason: str) -> None:
    (folder / "bad.txt").write_text("1 2 3\n")
    desk = desk_with("ball.npy")
    document = desk.document
    assert document is not None
    before = document.scene
    done(desk, command)
    assert reason in said(desk) and all(each.is_fault for each in desk.messages)
    assert document.scene is before and not document.history.past


def test_labels_and_back(folder: Path) -> None:
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd", "as-labels 2")
    volume = document.scene.volumes[1]
    assert volume.labels and not document.scene.volume.labels
    assert document.scene.added[0].transfer_function is transfer.proposed_for(volume)
    done(desk, "save kept.toml")
    assert opened_file("kept.toml", SIZE).scene.volumes[1].labels
    done(desk, "as-labels 2")
    assert not document.scene.volumes[1].labels and "labels" not in document.scene.volumes[1].source
    done(desk, "undo")
    assert document.scene.volumes[1] is volume
    wrong = done(desk_with("ball.npy"), "as-labels 1")
    assert not wrong.scene.volume.labels


def test_a_stand_in_and_its_store_move_and_become_labels_together() -> None:
    values = np.arange(48**3, dtype=np.uint8).reshape(48, 48, 48)
    standing = stand_in(large(Volume(values), 8, levels=3, memory=1 << 17)[0])
    assert isinstance(standing, StandIn)
    standing.source = standing.large.source = {"absolute": "/nowhere.zarr"}
    for change in (
        lambda volume: placing.with_spacing(volume, (2.0, 1.0, 3.0)),
        lambda volume: placing.with_transform(volume, MOVE),
        lambda volume: placing.with_labels(volume, True),
        lambda volume: placing.with_labels(volume, False),
    ):
        before, standing = standing, change(standing)
        other: Any = standing
        assert isinstance(other, StandIn) and other.large is not before.large
        assert other.labels == other.large.labels
        whole = other.large
        assert_allclose(other.corners_from_centre + other.centre, whole.corners_from_centre + whole.centre, atol=1e-9)


def test_channels_of_an_image_are_volumes_with_their_names_and_hues(folder: Path) -> None:
    desk = desk_with("cell.ome.tif")
    document = desk.document
    assert document is not None
    assert [each.channel.name for each in document.scene.volumes] == [f"stain {n}" for n in range(4)]  # type: ignore[union-attr]
    hues = [each.owner.medium.colors.max(axis=0) for each in list_editing.entries(document)]
    assert all(each.owner.medium.emissive for each in list_editing.entries(document))
    assert len({tuple(np.round(hue / hue.max(), 3)) for hue in hues}) == 4
    texvol(folder, "render", "cell.ome.tif", "--size", "40x30", "-o", "drawn.exr")
    assert image.read(folder / "drawn.exr").any()
    first = package.load("cell.ome.tif")
    assert [each.name for each in first.channels] == [f"stain {n}" for n in range(5)]
    assert len(package.load_channels("cell.ome.tif")) == 4


def test_channels_are_no_more_when_they_are_opened_again(folder: Path) -> None:
    desk = desk_with("cell.ome.tif")
    document = done(desk, "remove 3", "save kept.toml")
    assert names(opened_file("kept.toml", SIZE)) == ["cell.ome.tif"] * 3
    recent.remember("cell.ome.tif", document.scene)
    found = recent.files()[0]
    again = opened_file(found.path, SIZE, found.options)
    assert [each.channel.number for each in again.scene.volumes] == [0, 1, 3]  # type: ignore[union-attr]
    text = (folder / "kept.toml").read_text().splitlines()
    (folder / "plain.toml").write_text("\n".join(line for line in text if not line.startswith(("tf", "add"))))
    assert len(opened_file("plain.toml", SIZE).scene.volumes) == 1, "it is that channel alone"


def test_light_that_does_not_go_with_a_hidden_volume_is_said(folder: Path) -> None:
    desk = desk_with("cell.ome.tif")
    document = done(desk, "remove 4", "remove 3", "add ball.npy", "eye 1", "eye 2")
    assert eyes(document) == [False, False, True]
    desk.change(lighting=Lighting())
    done(desk, "eye 1")
    assert "lighting needs an associated transfer function" in said(desk) and eyes(document) == [False, False, True]


def test_a_world_is_named_by_directions_of_the_body(folder: Path) -> None:
    options = {"space": "right-anterior-superior"}
    volume = opened_file("lps.nrrd", SIZE, options).scene.volume
    assert volume.space == "right-anterior-superior"
    assert_array_equal(volume.origin, load("lps.nrrd").origin * (-1, -1, 1))
    message = str(raised(InputError, opened_file, "ball.npy", SIZE, options))
    assert "--space needs a file that names directions of the body, got none" in message


def test_python_scenes_draw_one_channel(folder: Path) -> None:
    scene = Scene(package.load("cell.ome.tif", channel=2)).looked
    assert scene.transfer_function is not None and scene.transfer_function.name == "stain 2"


def test_volumes_of_the_history_do_not_keep_what_shows_of_them(folder: Path) -> None:
    from texvol.scene import content

    desk = desk_with("ball.npy")
    known = len(content._KNOWN)
    document = done(desk, *(f"spacing 1 1,{1 + number / 10},1" for number in range(1, 8)))
    assert len(document.history.past) == 7 and len(content._KNOWN) <= known
    done(desk, *["undo"] * 7)
    assert len(content._KNOWN) <= known


def test_the_shown_list_changes_nothing_by_itself(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with panel_frames.headless():
        desk = panel_frames.desk_of_noise(folder, monkeypatch)
        document = done(desk, "opacity 1 0.2913")  # which is no number of single precision
        steps, scene = len(document.history.past), document.scene
        panel_frames.shown(desk, "Scene")
        assert document.scene is scene and len(document.history.past) == steps
        desk.step(back=True)
        panel_frames.shown(desk, "Scene")
        assert tinting.tint_of(document.scene.transfer_function).opacity == 1.0  # type: ignore[arg-type]
