"""Options for masks, transforms and further volumes: on the line, in a scene file, both, and wrong."""

from __future__ import annotations

import argparse
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.scene_lines import chosen, scene
from support.scenes import random_volume

import texvol
from texvol import InputError, load
from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.output.export import out_of_view
from texvol.scene import transfer
from texvol.scene.added_volume import common_box
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

VALUES, OTHER = random_volume(1).values, random_volume(2, (4, 5, 6)).values
MASK = (random_volume(3).values > 0.5).astype(np.uint8)
SHIFT = [[1, 0, 0, 2.5], [0, 1, 0, -1], [0, 0, 1, 0], [0, 0, 0, 1]]
IN_ROWS = "1,0,0,2.5,0,1,0,-1,0,0,1,0"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with volumes, masks and a transform."""
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", VALUES)
    np.save("w.npy", OTHER)
    np.save("m.npy", MASK)
    np.save("weights.npy", random_volume(3).values)
    np.save("labels.npy", MASK)
    np.save("of w.npy", OTHER > 0.5)
    Path("shift.txt").write_text("# to the right\n1 0 0 2.5\n0, 1, 0, -1\n 0 0 1\t0 # up\n\n0 0 0 1\n")
    Path("rows.txt").write_text("1 0 0 2.5\n0 1 0 -1\n0 0 1 0\n")
    return tmp_path


def same(one: Scene, other: Scene) -> None:
    """Both have the same volumes in the same places, masks and transfer functions."""
    assert len(one.added) == len(other.added)
    parts = [(each, each.volume, each.transfer_function, each.mask) for each in (one, *one.added)]
    others = [(each, each.volume, each.transfer_function, each.mask) for each in (other, *other.added)]
    for (_, volume, medium, mask), (_, wanted, wanted_medium, wanted_mask) in zip(parts, others, strict=True):
        np.testing.assert_array_equal(volume.values, wanted.values)
        np.testing.assert_array_equal(volume.world_from_index, wanted.world_from_index)
        np.testing.assert_array_equal(volume.origin, wanted.origin)
        assert (volume.labels, volume.name) == (wanted.labels, wanted.name)
        assert (medium is None) == (wanted_medium is None)
        assert medium is None or medium.as_json() == wanted_medium.as_json()  # type: ignore[union-attr]
        assert (mask is None) == (wanted_mask is None)
        assert mask is None or np.array_equal(mask.array, wanted_mask.array)  # type: ignore[union-attr]


SAME = [
    (["--mask", "m.npy"], 'mask = "m.npy"'),
    (["--mask", "m.npy"], 'mask = {file = "m.npy"}'),
    (["--mask", "weights.npy:0.25,.75"], 'mask = "weights.npy:0.25,0.75"'),
    (["--mask", "weights.npy:1,-1e-1"], 'mask = {file = "weights.npy", fade = [1, -0.1]}'),
    (["--transform", "shift.txt"], 'transform = "shift.txt"'),
    (["--transform", IN_ROWS], "transform = [1, 0, 0, 2.5, 0, 1, 0, -1, 0, 0, 1, 0]"),
    (["--transform", f"{IN_ROWS},0,0,0,1"], f"transform = {SHIFT}"),
    (["--transform", "rows.txt"], f"transform = {SHIFT[:3]}"),
    (["--add", "w.npy"], 'add = "w.npy"'),
    (["--add", "w.npy", "--add", "v.npy"], 'add = ["w.npy", "v.npy"]'),
    (["--add", "w.npy", "--add", "v.npy"], '[[add]]\nfile = "w.npy"\n[[add]]\nfile = "v.npy"'),
    (
        ["--add", "w.npy", "--add-tf", "fog", "--add-spacing", "1,2,3", "--add", "v.npy", "--add-mask", "m.npy"],
        '[[add]]\nfile = "w.npy"\ntf = "fog"\nspacing = [1, 2, 3]\n[[add]]\nfile = "v.npy"\nmask = {file = "m.npy"}',
    ),
    (
        ["--add", "w.npy", "--add-transform", "-1,0,0,0,0,-1,0,0,0,0,1,0", "--add-mask", "of w.npy"],
        'add = {file = "w.npy", transform = [[-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 1, 0]], mask = "of w.npy"}',
    ),
    (
        ["--add", "labels.npy", "--add-labels", "--add-label-look", "1=#ff8000:0.5"],
        'add = [{file = "labels.npy", labels = true, label_look = "1=#ff8000:0.5"}]',
    ),
    (
        ["--add", "w.npy", "--add-tf", "table-5-1", "--add-materials", "bone,fat"],
        'add = [{file = "w.npy", tf = "table-5-1", materials = ["bone", "fat"]}]',
    ),
    (["--add", "labels.npy", "--add-labels", "--no-add-labels"], 'add = [{file = "labels.npy", labels = false}]'),
]


@pytest.mark.parametrize(("line", "file"), SAME, ids=[" ".join(each[0]) for each in SAME])
def test_line_and_file_say_the_same(line: list[str], file: str) -> None:
    found = scene(*line)
    same(found, scene(file=file))
    assert found.mask is not None or found.added or found.volume.origin.any()


def test_what_follows_add_is_of_the_last() -> None:
    first, second, third = scene(
        "--tf", "grey", "--add", "w.npy", "--add-tf", "fog", "--add", "v.npy", "--add", "w.npy", "--add-tf", "solid"
    ).added
    names = [each.transfer_function and each.transfer_function.name for each in (first, second, third)]
    assert names == ["fog", "proposed", "solid"]
    assert second.transfer_function.colors[-2].argmax() == 1  # greenish: each a hue of its own
    assert scene("--add", "w.npy", "--add-tf", "fog", "--add-tf", "grey").added[0].transfer_function.name == "grey"


def test_every_way_to_read_a_volume_is_there_for_a_further_one(monkeypatch: pytest.MonkeyPatch) -> None:
    (OTHER * 1000).astype(">i2").tofile("w.raw")
    line = ["--add", "w.raw", "--add-shape", "4,5,6", "--add-dtype", ">i2", "--add-spacing", "1,2,3"]
    [added] = scene(*line).added
    np.testing.assert_array_equal(added.volume.values, (OTHER * 1000).astype(np.int16))
    help_text = _help("render")
    assert all(f"--add-{name}" in help_text for name in (*reading_options.READING, "spacing", "transform", "mask"))


def test_channels_of_a_file_are_volumes_of_their_own() -> None:
    np.save("two.npy", np.stack([VALUES, 2 * VALUES]))
    found = scene("--channel", "0", "--add", "two.npy", "--add-channel", "1", volume="two.npy")
    np.testing.assert_array_equal(found.volume.values, VALUES)
    np.testing.assert_array_equal(found.added[0].volume.values, 2 * VALUES)


def test_a_segmentation_that_is_added_is_of_labels_unless_an_option_says_how_it_is_drawn() -> None:
    labels = np.zeros((20, 20, 20), np.uint8)
    labels[5:15, 5:15, 5:10], labels[5:15, 5:15, 10:15] = 3, 7
    np.save("segments.npy", labels)

    def added(*words: str) -> Volume:
        return scene("--add", "segments.npy", *words).added[0].volume

    assert added().labels
    assert added("--add-label-look", "7=0.5").labels
    assert not added("--no-add-labels").labels
    assert not added("--add-tf", "fog").labels
    assert not scene("--add", "w.npy").added[0].volume.labels


def test_paths_of_a_scene_file_are_beside_it(folder: Path) -> None:
    (folder / "deep").mkdir()
    for name in ("w.npy", "m.npy", "of w.npy", "shift.txt", "rows.txt"):
        os.rename(name, f"deep/{name}")
    (folder / "deep" / "tf.json").write_text(
        json.dumps({"points": [{"value": 0, "color": [1, 1, 1], "extinction": 1}]})
    )
    file = (
        'mask = "m.npy"\ntransform = "shift.txt"\n[[add]]\nfile = "w.npy"\ntf = "tf.json"\ntransform = "rows.txt"\n'
        'mask = {file = "of w.npy"}\n[[add]]\nfile = "w.npy"\ntf = "fog"'
    )
    found = scene(file=file, path="deep/scene.toml")
    np.testing.assert_array_equal(found.volume.origin, (2.5, -1, 0))
    np.testing.assert_array_equal(found.added[0].volume.origin, (2.5, -1, 0))
    assert [each.volume.name for each in found.added] == ["deep/w.npy"] * 2


def test_the_line_wins() -> None:
    file = 'mask = "m.npy"\n[[add]]\nfile = "w.npy"\n[[add]]\nfile = "w.npy"'
    found = scene("--add", "v.npy", "--mask", "weights.npy", file=file)
    assert [each.volume.name for each in found.added] == ["v.npy"]
    assert found.mask is not None and found.mask.name == "weights.npy"


def test_a_look_of_the_line_takes_the_place_of_another_kind() -> None:
    by_label = 'label-look = "1=0.5"'
    assert scene("--tf", "fog", file=by_label).transfer_function.name == "fog"  # type: ignore[union-attr]
    by_medium = 'tf = "table-5-1"\nmaterials = "bone"'
    look = scene("--labels", "--label-look", "1=0.5", file=by_medium, volume="labels.npy").transfer_function
    wanted = transfer.labels.label_function(Volume(MASK, labels=True), {1: 0.5})
    assert look is not None and look.as_json()["points"] == wanted.as_json()["points"]


def test_a_mode_of_the_line_drops_further_volumes_of_the_file() -> None:
    assert not scene("--mode", "mip", file='add = "w.npy"').added


def test_the_camera_frames_all_volumes() -> None:
    found = scene("--add", "w.npy", "--add-transform", "1,0,0,40,0,1,0,0,0,0,1,0", "--fit", "box")
    assert found.camera is not None
    np.testing.assert_allclose(found.camera.target, common_box(found.volumes).centre)
    for volume in found.volumes:
        corners = found.camera.in_eye_space(volume.corners_from_centre, volume.centre)
        assert (np.abs(corners[:, :2]) <= found.camera.half_height).all()


def test_an_orbit_frames_all_volumes() -> None:
    made = chosen("--add", "w.npy", "--add-transform", "1,0,0,40,0,1,0,0,0,0,1,0")
    camera = made.scene(made.load(), orbit=True).camera
    assert camera is not None and camera.height > 40


def test_a_view_that_misses_one_of_two_volumes_is_no_empty_view() -> None:
    found = scene("--add", "w.npy", "--add-transform", "1,0,0,400,0,1,0,0,0,0,1,0")
    assert found.camera is not None
    for target, missed in (((404.0, 2, 2), False), ((4.0, 4, 2), False), ((200.0, 4, 2), True)):
        camera = replace(found.camera, eye=(target[0], -500.0, 2.0), target=target, height=20.0)
        assert (len(out_of_view(replace(found, camera=camera), (20, 20))) == 2) == missed


def test_volumes_outside_of_the_view_are_warned_of_together(capsys: pytest.CaptureFixture[str]) -> None:
    line = ["render", "v.npy", "-o", "a.exr", "--size", "8x8", "--add", "w.npy", "--height", "2"]
    assert main([*line, "--eye", "100,-50,0", "--target", "100,0,0"]) == 0
    assert capsys.readouterr().err == ("texvol: warning: the picture is empty: all volumes are outside the view\n")
    assert not read_picture("a.exr").pixels.any()
    assert (
        main([*line, "--eye", "100,-50,0", "--target", "100,0,0", "--add-transform", "1,0,0,100,0,1,0,0,0,0,1,0"]) == 0
    )
    assert capsys.readouterr().err == "texvol: warning: v.npy is outside the view\n"
    # Cut away, hidden, or with nothing to be seen.
    np.save("nothing.npy", np.zeros((4, 4, 4), np.uint8))
    np.save("fours.npy", np.full((4, 4, 4), 5.0))
    nothing = {"points": [{"value": 0, "color": [1, 1, 1], "extinction": 0}]}
    Path("nothing.json").write_text(json.dumps(nothing))
    empty = ["render", "fours.npy", "-o", "a.exr", "--size", "8x8"]
    for more, what in (
        (["--clip", "1,0,0,1e6"], "clip planes and crop box hide everything"),
        (["--mask", "nothing.npy"], "the mask hides everything"),
        (["--tf", "nothing.json"], "nothing in the volume is visible"),
    ):
        assert main([*empty, *more]) == 0
        assert capsys.readouterr().err == f"texvol: warning: the picture is empty: {what}\n"


# Whatever is wrong.

WRONG = [
    (["--mask", "gone.npy"], "gone.npy: no such file"),
    (["--mask", "w.npy"], "w.npy: a mask must have as many samples as its volume, got 4 x 5 x 6 samples"),
    (["--mask", "huge.npy"], "huge.npy: weights must be from 0 to 1, but they go from 0.5 to 3"),
    (["--mask", "m.npy:1,1"], "--mask: LOW,HIGH must be two different finite numbers"),
    (["--mask", "m.npy:1,1e999"], "--mask: LOW,HIGH must be two different finite numbers"),
    (["--mask", ""], "--mask: must be FILE[:LOW,HIGH]"),
    (["--transform", "gone.txt"], "gone.txt: cannot be read: No such file"),
    (["--transform", "v.npy"], "v.npy: is not a transform"),
    (["--transform", "short.txt"], "short.txt: a transform must be 4 rows of 4 numbers"),
    (["--transform", "words.txt"], "words.txt: a transform must be 4 rows of 4 numbers"),
    (["--transform", "nan.txt"], "nan.txt: a transform must be 4 rows of 4 numbers"),
    (["--transform", "last.txt"], "v.npy: a transform must be a finite 4 x 4 matrix whose last row is 0, 0, 0, 1"),
    (["--transform", "1,2,3"], "--transform: must be 12 or 16 numbers"),
    (["--transform", ""], "--transform: must be 12 or 16 numbers"),
    (["--transform", "0,0,0,0,0,1,0,0,0,0,1,0"], "v.npy, transformed: direction must not be singular"),
    (["--add", "gone.npy"], "gone.npy: no such file"),
    (["--add", ""], "--add: must be the path of a file or folder"),
    (["--add", "short.txt"], "short.txt"),
    (["--add-tf", "fog"], "--add-tf: needs a volume to apply to: give --add FILE before it"),
    (["--add-mask", "m.npy", "--add", "w.npy"], "--add-mask: needs a volume to apply to"),
    (["--add-labels"], "--add-labels/--no-add-labels: needs a volume to apply to"),
    (["--add", "w.npy", "--add-mask", "m.npy"], "m.npy: a mask must have as many samples as its volume, got 9 x 8 x 7"),
    (
        ["--add", "w.npy", "--add-transform", "1,0,0,0,1,0,0,0,0,0,1,0"],
        "w.npy, transformed: direction must not be sing",
    ),
    (["--add", "w.npy", "--add-time", "all"], "--add-time: must be a whole number of at least 0, got 'all'"),
    (
        ["--add", "w.npy", "--add-tf", "gold"],
        "'gold' must be a file such as .json or .toml, the name of a colour map, or a preset",
    ),
    (["--add", "w.npy", "--add-materials", "bone"], "--materials needs --tf"),
    (["--add", "w.npy", "--add-labels"], "w.npy: labels must be whole numbers"),
    (["--add", "w.npy", "--add-label-look", "1=0.5"], "w.npy: values must be labels"),
    (["--add", "w.npy", "--mode", "mip"], "--add needs --mode composite, got --mode mip"),
    (["--add", "labels.npy", "--add-labels", "--add-label-look", "5=0.5"], "label 5 not found"),
    (["--add", "labels.npy", "--add-labels", "--add-label-look", "red"], "--add-label-look: labels must be LABEL=OPA"),
    (["--tf", "fog", "--label-look", "1=0.5"], "--label-look and --tf both set the look of labels"),
    (["--add", "w.npy", "--add-tf", "fog", "--add-label-look", "1=0.5"], "--label-look and --tf both set"),
    (["--label-look", "1=0.5", "--mode", "mip"], "--label-look needs --mode composite, got --mode mip"),
]
WRONG_FILES = [
    ("mask = 3", "mask: must be a file, or {file = FILE, fade = [LOW, HIGH]}, got 3"),
    ('mask = {path = "m.npy"}', "mask: must be {file = FILE, fade = [LOW, HIGH]}"),
    ('mask = {file = "m.npy", fade = 3}', "mask: must be {file = FILE"),
    ('mask = {file = "m.npy", fade = [0, true]}', "mask: must be {file = FILE"),
    ("transform = [1, 2]", "transform: must be 12 or 16 numbers"),
    ("transform = [[1, 0, 0, 0], 1]", "transform: must be 12 or 16 numbers"),
    ("transform = true", "transform: must be 12 or 16 numbers"),
    ('add = {tf = "fog"}', "add: must have a file"),
    ('add = {file = "w.npy", colour = 3}', "add: unknown key 'colour'; keys are file, tf, "),
    ('add = {file = "w.npy", time = "all"}', "add: time: must be a whole number of at least 0"),
    ('add = {file = "w.npy", labels = 1}', "labels must be true or false, got 1"),
    ('add = {file = "w.npy", mask = 1}', "add: mask: must be a file"),
    ('add = {file = "w.npy", materials = "bone"}', "--materials needs --tf"),
    ("add = true", "add must be text, a number or an array of numbers, got True"),
    ("add-tf = 3", "unknown scene option 'add-tf'"),
]


@pytest.fixture
def bad_files() -> None:
    np.save("huge.npy", np.linspace(0.5, 3, VALUES.size).reshape(VALUES.shape))
    texts = {"short": "1 0 0\n0 1 0\n0 0 1\n", "words": "1 0 0 a\n" * 4, "nan": "1 0 0 nan\n" * 4}
    texts["last"] = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 1\n"
    for name, text in texts.items():
        Path(f"{name}.txt").write_text(text)


def refused(capsys: pytest.CaptureFixture[str], *line: str) -> str:
    """What a wrong line says, in one line; it leaves no picture."""
    capsys.readouterr()
    assert main(["render", "v.npy", "-o", "a.png", "--size", "8x8", *line]) == 2
    said = capsys.readouterr().err
    assert said.startswith("texvol: error: ") and said.count("\n") == 1
    assert not Path("a.png").exists()
    return said


@pytest.mark.parametrize(("line", "words"), WRONG, ids=[" ".join(each[0]) for each in WRONG])
def test_what_is_wrong_on_the_line(
    line: list[str], words: str, bad_files: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert words in refused(capsys, *line)


@pytest.mark.parametrize(("file", "words"), WRONG_FILES, ids=[each[0] for each in WRONG_FILES])
def test_what_is_wrong_in_a_file(file: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scene.toml").write_text(file, encoding="utf-8")
    assert words in refused(capsys, "--scene", "scene.toml")


def test_options_that_do_not_go_together_are_found_before_anything_is_read(capsys: pytest.CaptureFixture[str]) -> None:
    Path("v.npy").unlink()
    for line in (
        ["--add", "gone.npy", "--mode", "mip"],
        ["--add-tf", "fog"],
        ["--add", "gone.npy", "--add-tf", "fog", "--add-label-look", "1=1"],
    ):
        assert ".npy" not in refused(capsys, *line)


def _help(command: str) -> str:
    parser = argparse.ArgumentParser(prog=command)
    reading_options.add_volume_options(parser)
    options.add_scene_options(parser)
    return parser.format_help()


def test_load_is_not_asked_for_more_than_it_knows() -> None:
    """Each option of a further volume that is not its look or its place is an argument of `load`."""
    import inspect

    from texvol.options.volumes import LOOK, OF_ADDED, POSITION

    own = {option.name for option in (*LOOK, *POSITION)} - {"spacing"}
    named = {each.option.name for each in OF_ADDED} - own
    assert {name.replace("-", "_") for name in named} == set(inspect.signature(load).parameters) - {"path"}


def test_the_parts_of_such_scenes_are_at_the_top() -> None:
    for name in ("Mask", "AddedVolume", "TimeSeries", "Annotation"):
        assert name in texvol.__all__ and getattr(texvol, name).__name__ == name


def test_what_a_scene_file_says_wrongly_has_its_name() -> None:
    with pytest.raises(InputError, match=r"^deep\.toml: add: "):
        chosen(file="add = {}", path="deep.toml")
