"""Looks: transfer function and light together, by a preset's name or by the kind of data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.real_data import real_volume
from support.scenes import FOG, random_volume

from texvol import AddedVolume, InputError, Lighting, Renderer, Scene, TransferFunction, Volume, load
from texvol.options.looks import load_look
from texvol.scene.dark_objects import ends_of
from texvol.scene.gradient import Estimator
from texvol.scene.kinds import kind_of
from texvol.scene.looks import EXPOSED, Look, look_as_is, look_for, look_of
from texvol.scene.transfer import PRESETS, preset

POINTS = '"points": [{"value": 0, "color": [0, 0, 0], "extinction": 0}, {"value": 1, "color": "white", "opacity": 0.5}]'
GAS = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 1.0]), emissive=True)
MASK = Volume(np.pad(np.ones((4, 4, 4), np.uint8), 3))


def test_light_of_a_look_takes_white_to_one_at_most() -> None:
    """The exposure keeps highlights: D + S of a head light is 1 where a surface faces it, and nowhere more."""
    assert EXPOSED.brightest == pytest.approx(1.0)


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_by_name_is_lit_and_one_by_its_points_is_not(name: str) -> None:
    volume = random_volume(1)
    by_name, medium = Scene(volume, name), preset(name, volume)
    np.testing.assert_array_equal(by_name.transfer_function.colors, medium.colors)
    assert by_name.lighting == (None if name in ("fog", "fluorescence") else EXPOSED)
    assert Scene(volume, medium).looked.lighting is None
    assert Scene(volume, name, lighting="none").looked.lighting is None
    if not medium.emissive:
        assert Scene(volume, name, lighting=Lighting(ambient=0.5)).lighting == Lighting(ambient=0.5)


def test_a_scene_without_a_transfer_function_gets_the_look_of_its_data() -> None:
    scene = Scene(random_volume(1))
    assert scene.looked is scene.looked and scene.looked.transfer_function is look_for(scene.volume).transfer_function
    assert scene.looked.lighting == EXPOSED
    assert scene.completed((9, 9)).lighting == EXPOSED
    assert replace(scene, mode="mip").looked.transfer_function is None
    unlit = Scene(random_volume(1), lighting="none")
    assert (unlit.looked.lighting, unlit.needs_gradient) == (None, False)
    assert replace(unlit, background=(1, 1, 1)).looked.lighting is None


def test_values_that_look_like_labels_are_drawn_as_labels() -> None:
    scene = Scene(MASK).looked
    assert scene.volume.labels and scene.lighting is not None
    assert scene.transfer_function.materials == ("label 1",)
    assert Scene(MASK, lighting="none").volume.labels
    as_it_is = look_as_is(MASK)
    assert not as_it_is.transfer_function.materials and as_it_is.lighting == EXPOSED


@pytest.mark.parametrize("ends", [(0.0, 1.0), (-3e4, 2e4), (1e300, 5e300)])
def test_a_negative_is_drawn_as_what_it_is_of(renderer: Renderer, ends: tuple[float, float]) -> None:
    z, y, x = np.ogrid[-1:1:20j, -1:1:22j, -1:1:24j]
    brightness = np.exp(-6 * (x**2 + 2 * y**2 + z**2)) * (1 + 0.3 * np.sin(9 * x + 4 * z))
    brightness = np.maximum(brightness / brightness.max() - 0.1, 0) / 0.9
    low, high = ends
    positive = Volume(low * (1 - brightness) + high * brightness, (1, 1.2, 0.9))
    negative = Volume(high * (1 - brightness) + low * brightness, (1, 1.2, 0.9))
    assert (look_for(positive).name, kind_of(negative).name) == ("proposal", "dark")
    one, other = (renderer.render(Scene(each), (40, 30), slab_thickness=0.25) for each in (positive, negative))
    assert one[..., 3].max() > 0.9
    np.testing.assert_allclose(other, one, atol=1e-5)  # single precision


def test_negatives_of_real_volumes_have_the_transfer_function_of_their_positives() -> None:
    for name in ("tooth/tooth.nhdr", "engine/engine.nii.gz", "fly/fly_150x256x256.tif"):
        positive = load(real_volume(name))
        ends = ends_of(positive)
        negative = Volume(sum(ends) - positive.values.astype(np.float64), positive.spacing)
        values = np.linspace(*ends, 50)
        wanted = look_for(positive).transfer_function.classify(values)
        found = look_for(negative).transfer_function.classify(sum(ends) - values)
        np.testing.assert_allclose(found.extinction, wanted.extinction, atol=1e-12 * wanted.extinction.max())


def test_a_medium_that_emits_leaves_all_unlit() -> None:
    volume = random_volume(1)
    assert Scene(volume, added=(AddedVolume(random_volume(2), GAS),)).looked.lighting is None
    assert Scene(volume, added=(AddedVolume(random_volume(2), FOG),)).looked.lighting == EXPOSED


def test_a_look_may_have_all_its_parts() -> None:
    look = Look(FOG, Lighting(ambient=0.1), Estimator("gaussian", 2), (0.1, 0.2, 0.3))
    scene = Scene(random_volume(1), look)
    assert (scene.transfer_function, scene.lighting, scene.gradient, scene.background) == (
        FOG, Lighting(ambient=0.1), Estimator("gaussian", 2), (0.1, 0.2, 0.3)
    )  # fmt: skip
    assert Scene(random_volume(1), look, background=(1, 1, 1)).background == (1, 1, 1)


def test_ct_shows_bone_where_there_is_any() -> None:
    values = np.full((16, 16, 16), -1000.0)
    values[4:12, 4:12, 4:12] = 40
    soft = Volume(values.copy(), value_unit="HU")
    values[6:10, 6:10, 6:10] = 900
    assert (look_for(soft).name, look_for(Volume(values, value_unit="HU")).name) == ("ct-soft-tissue", "ct-bone")


@pytest.mark.parametrize("suffix", ["json", "toml"])
def test_a_file_may_hold_light_gradient_and_background(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"look.{suffix}"
    if suffix == "json":
        path.write_text(
            "{" + POINTS + ', "light": ["head:0.5"], "specular": 0.1, '
            '"gradient": "gaussian:2", "background": "#ffffff"}'
        )
    else:
        path.write_text(
            'light = ["head:0.5"]\nspecular = 0.1\ngradient = "gaussian:2"\nbackground = "#ffffff"\n'
            "[[points]]\nvalue = 0\ncolor = [0, 0, 0]\nextinction = 0\n"
            '[[points]]\nvalue = 1\ncolor = "white"\nopacity = 0.5\n'
        )
    look = load_look(str(path), random_volume(1))
    assert look.lighting is not None and look.lighting.lights[0].color == (0.5, 0.5, 0.5)
    assert (look.lighting.specular, look.gradient, look.background) == (0.1, Estimator("gaussian", 2), (1, 1, 1))
    np.testing.assert_array_equal(look.transfer_function.colors[1], (1, 1, 1))
    assert TransferFunction.load(path).values.tolist() == [0, 1]


def test_a_file_without_light_is_unlit(tmp_path: Path) -> None:
    path = tmp_path / "plain.json"
    path.write_text("{" + POINTS + "}")
    look = load_look(str(path), random_volume(1))
    assert (look.lighting, look.background) == (None, None)


@pytest.mark.parametrize(
    "more, words",
    [
        ('"light": "sun"', "light: must be head"),
        ('"background": "blak"', "background: "),
        ('"shine": 1', "key 'shine' not known"),
    ],
)
def test_what_is_wrong_in_a_look_is_named(tmp_path: Path, more: str, words: str) -> None:
    path = tmp_path / "wrong.json"
    path.write_text("{" + POINTS + ", " + more + "}")
    with pytest.raises(InputError, match=words):
        load_look(str(path), random_volume(1))


def test_looks_say_what_they_are_and_why() -> None:
    assert look_of("ct-bone", random_volume(1)).sentence == "look ct-bone, lit"
    assert look_of("fog", random_volume(1)).sentence == "look fog, unlit"
    assert look_for(MASK).sentence.startswith("look labels, lit: its values are 2 whole numbers")
