"""Transfer functions of other programs with unusual content: logarithms, ends without clamping, marks and roundings."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.vtk_states import volume_property_file
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkColorTransferFunction

from texvol import InputError, TransferFunction, Volume
from texvol.scene.transfer import preset
from texvol.util.color import linear_from_srgb

OPACITY, LIGHT = 1.5 / 1024, 3 / 1024  # see test_transfer_foreign.py
VALUES = np.random.default_rng(1).uniform(0.5, 110, 1000)
CUBE = Volume(np.arange(60.0).reshape(3, 4, 5), spacing=(2, 3, 4))
RAMP = {"RGBPoints": [0, 0, 0, 0, 100, 1, 1, 1], "Points": [0, 0, 0.5, 0, 100, 0.5, 0.5, 0]}


def logarithmic_colors(color: Any, _: Any) -> None:
    color.SetScaleToLog10()


def logarithmic_opacity(_: Any, opacity: Any) -> None:
    opacity.SetUseLogScale(True)


def unclamped(color: Any, opacity: Any) -> None:
    color.ClampingOff()
    opacity.ClampingOff()


def colors_beyond(color: Any, _: Any) -> None:
    color.SetUseBelowRangeColor(True)
    color.SetBelowRangeColor(0.1, 0.9, 0.2)
    color.SetUseAboveRangeColor(True)
    color.SetAboveRangeColor(0.3, 0.2, 0.8)


@pytest.mark.parametrize("change", [logarithmic_colors, logarithmic_opacity, unclamped, colors_beyond])
def test_vtks_settings_of_functions(tmp_path: Path, change: Callable[[Any, Any], None]) -> None:
    color, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
    random = np.random.default_rng(6)
    for value in (1, 10, 40, 90):
        color.AddRGBPoint(value, *random.random(3))
        opacity.AddPoint(value, random.uniform(0.1, 0.97))
    change(color, opacity)
    numbers = TransferFunction.load(volume_property_file(tmp_path, color, opacity, 2.5)).at(VALUES)
    opacities = np.array([opacity.GetValue(value) for value in VALUES])
    shown = opacities > 0
    assert np.abs(-np.expm1(-numbers[:, 3] * 2.5) - opacities).max() < OPACITY
    wanted = linear_from_srgb(np.array([color.GetColor(value) for value in VALUES]))
    assert np.abs(numbers[:, :3] - wanted)[shown].max() < LIGHT


def test_logarithms_need_positive_values(tmp_path: Path) -> None:
    state = {"ClassName": "vtkColorTransferFunction", "Scale": 1, "Data": [0, 0, 0, 0, 9, 1, 1, 1]}
    (tmp_path / "v.json").write_text(json.dumps(state))
    with pytest.raises(InputError, match=r"v\.json: values of vtkColorTransferFunction must be above 0 .* got 0"):
        TransferFunction.load(tmp_path / "v.json", CUBE)


@pytest.mark.parametrize("name", ["plasma", "crameri:batlow", "turbo"])
def test_reversed_colour_maps(name: str) -> None:
    forth, back = preset(name, CUBE), preset(f"{name}_r", CUBE)
    low, high = forth.values[0], forth.values[-1]
    np.testing.assert_allclose(back.at(VALUES)[:, :3], forth.at(low + high - VALUES)[:, :3], atol=LIGHT)
    np.testing.assert_allclose(back.at(VALUES)[:, 3], forth.at(VALUES)[:, 3], atol=1e-2)
    with pytest.raises(InputError, match="'batlov_r' not found"):
        preset("batlov_r", CUBE)


def test_numbers_that_rounding_took_out_of_their_range(tmp_path: Path) -> None:
    content = {
        "RGBPoints": [0, -1e-17, 0, 0, 100, 1.0000001, 1, 1],
        "Points": [0, -1e-9, 0.5, 0, 100, 1 + 1e-7, 0.5, 0],
    }
    (tmp_path / "m.json").write_text(json.dumps(content))
    found = TransferFunction.load(tmp_path / "m.json", CUBE).at([0.0, 100.0])
    np.testing.assert_allclose(found[:, :3], [[0, 0, 0], [1, 1, 1]], atol=1e-12)
    content["RGBPoints"][5] = 1.01
    (tmp_path / "m.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="RGBPoints must be from 0 to 1, got 0 to 1.01"):
        TransferFunction.load(tmp_path / "m.json", CUBE)


def test_a_byte_order_mark_is_no_content(tmp_path: Path) -> None:
    (tmp_path / "m.json").write_text(json.dumps(RAMP), encoding="utf-8-sig")
    (tmp_path / "own.json").write_text('{"points": [{"value": 0, "color": [1, 1, 1], "extinction": 1}]}', "utf-8-sig")
    (tmp_path / "t.1dt").write_text("0 0 0 0\n1 1 1 0.5\n", encoding="utf-8-sig")
    for name in ("m.json", "own.json", "t.1dt"):
        assert TransferFunction.load(tmp_path / name, CUBE).extinctions.max() > 0


def test_a_wrong_length_names_its_file(tmp_path: Path) -> None:
    part = {
        "scalarOpacity": {"points": [{"x": 0, "y": 0}]}, "scalarOpacityUnitDistance": 0,
        "rgbTransferFunction": {"points": [{"x": 0, "color": [0, 0, 0]}]},
    }  # fmt: skip
    (tmp_path / "v.vp.json").write_text(json.dumps({"volumeProperties": [{"components": [part]}]}))
    with pytest.raises(InputError, match=r"v\.vp\.json: its unit distance must be a finite number above 0, got 0"):
        TransferFunction.load(tmp_path / "v.vp.json", CUBE)


@pytest.mark.parametrize(
    ("name", "how", "read"),
    [
        ("f.json", {}, {}), ("f.vp", {}, {}), ("f.vp.json", {"unit_distance": 0.5}, {}),
        ("map.json", {"to": "paraview", "unit_distance": 2, "name": "own"}, {"unit_distance": 2}),
    ],
)  # fmt: skip
def test_a_transfer_function_is_saved_for_other_programs(tmp_path: Path, name: str, how: Any, read: Any) -> None:
    wanted = TransferFunction([0, 50], [[1, 0, 0], [0, 0, 1]], [0.5, 2])
    wanted.save(tmp_path / name, **how)
    found = TransferFunction.load(tmp_path / name, **read)
    np.testing.assert_allclose(found.at([0, 25, 50]), wanted.at([0, 25, 50]), atol=0.005)


@pytest.mark.parametrize(
    ("name", "how", "reason"),
    [
        ("f.txt", {}, r"f\.txt: the name must end with .json"), ("f.vp.json", {}, "--unit-distance L must be given"),
        ("f.json", {"to": "paraview", "unit_distance": 0}, "--unit-distance must be a finite length above 0, got 0"),
        ("f.json", {"to": "vtk"}, "to must be one of texvol, paraview, slicer, got 'vtk'"),
        ("no/f.json", {}, "its folder .* does not exist"),
    ],
)  # fmt: skip
def test_what_cannot_be_saved_is_refused(tmp_path: Path, name: str, how: Any, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        TransferFunction([0, 50], [[1, 0, 0], [0, 0, 1]], [0.5, 2]).save(tmp_path / name, **how)
