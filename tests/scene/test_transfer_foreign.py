"""Transfer functions of other programs: between VTK's own interpolation and ours, in units that are told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.vtk_states import volume_property_file
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkColorTransferFunction

from texvol import InputError, TransferFunction, Volume
from texvol.scene.transfer.foreign import writing
from texvol.util import remarks
from texvol.util.color import linear_from_srgb

# Lines between the points keep opacity and encoded colour within 1/1024 at three places of an interval; between these
# both are smooth. The slope of the linear light over the encoded colour is up to 2.3.
OPACITY, LIGHT = 1.5 / 1024, 3 / 1024
VALUES = np.random.default_rng(1).uniform(-10, 110, 1000)
CUBE = Volume(np.arange(60.0).reshape(3, 4, 5), spacing=(2, 3, 4))


def nodes(seed: int, *, shaped: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Rows of value, red, green, blue, and of value, opacity, midpoint and sharpness."""
    random = np.random.default_rng(seed)
    values = np.sort(random.uniform(0, 100, 5))
    shapes = (
        np.column_stack([random.uniform(0.2, 0.8, 5), random.uniform(0, 0.8, 5)])
        if shaped
        else np.tile([0.5, 0], (5, 1))
    )
    colors = np.column_stack([values, random.random((5, 3))])
    return colors, np.column_stack([values + 1, random.uniform(0, 0.97, 5), shapes])


def of_vtk(colors: np.ndarray, opacities: np.ndarray, space: str) -> np.ndarray:
    """Linear light and opacity by VTK, shape (n, 4)."""
    color, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
    getattr(color, f"SetColorSpaceTo{space}")()
    for row in colors:
        color.AddRGBPoint(*row)
    for row in opacities:
        opacity.AddPoint(*row)
    light = linear_from_srgb(np.array([color.GetColor(value) for value in VALUES]))
    return np.column_stack([light, [opacity.GetValue(value) for value in VALUES]])


def check(found: TransferFunction, wanted: np.ndarray, unit: float) -> None:
    numbers = found.at(VALUES)
    assert np.abs(-np.expm1(-numbers[:, 3] * unit) - wanted[:, 3]).max() < OPACITY
    assert np.abs(numbers[:, :3] - wanted[:, :3]).max() < LIGHT


def written(folder: Path, name: str, content: Any) -> Path:
    (folder / name).write_text(content if isinstance(content, str) else json.dumps(content))
    return folder / name


def paraview(colors: np.ndarray, opacities: np.ndarray, **more: Any) -> list[dict[str, Any]]:
    return [{"Name": "own", "RGBPoints": colors.ravel().tolist(), "Points": opacities.ravel().tolist(), **more}]


@pytest.mark.parametrize("space", ["RGB", "HSV", "Lab", "Diverging", "Step"])
@pytest.mark.parametrize("shaped", [False, True])
def test_a_colour_map_of_paraview_is_vtks(tmp_path: Path, space: str, shaped: bool) -> None:
    colors, opacities = nodes(3, shaped=shaped)
    path = written(tmp_path, "map.json", paraview(colors, opacities, ColorSpace=space, HSVWrap=True))
    found = TransferFunction.load(path, unit_distance=2.5)
    check(found, of_vtk(colors, opacities, space), 2.5)
    assert len(found.values) < 400


def test_the_diverging_map_of_paraview(tmp_path: Path) -> None:
    """Cool to Warm: white is in the middle, and no point says so."""
    colors = np.array(
        [[0, 0.231373, 0.298039, 0.752941], [50, 0.865003, 0.865003, 0.865003], [100, 0.705882, 0.0156863, 0.14902]]
    )
    opacities = np.array([[0, 0.2, 0.5, 0], [100, 0.2, 0.5, 0]])
    found = TransferFunction.load(
        written(tmp_path, "m.json", paraview(colors, opacities, ColorSpace="Diverging")), unit_distance=1
    )
    check(found, of_vtk(colors, opacities, "Diverging"), 1)


def test_an_opacity_of_one_is_opaque_and_near_it_is_not(tmp_path: Path) -> None:
    colors = np.array([[0, 1, 1, 1], [100, 1, 1, 1]])
    opacities = np.array([[0, 0, 0.5, 0], [50, 1, 0.5, 0], [100, 0, 0.5, 0]])
    found = TransferFunction.load(written(tmp_path, "m.json", paraview(colors, opacities)), unit_distance=1)
    assert np.isinf(found.at(50.0)[3])
    check(found, of_vtk(colors, opacities, "RGB"), 1)


def noted(make: Any) -> tuple[TransferFunction, str]:
    """Transfer function of a file, and the remarks that a command would print."""
    remarks.begin()
    return make(), " ".join(remarks.taken())


def test_a_length_that_no_file_has_is_paraviews_and_told(tmp_path: Path) -> None:
    path = written(tmp_path, "m.json", paraview(*nodes(3)))
    found, told = noted(lambda: TransferFunction.load(path, CUBE))
    diagonal = np.linalg.norm(np.array([4, 3, 2]) * (2, 3, 4))
    wanted = TransferFunction.load(path, unit_distance=float(diagonal / 24 ** (1 / 3)))
    np.testing.assert_allclose(found.extinctions, wanted.extinctions)
    assert "m.json: its opacities are per mean edge of the volume's cells" in told and "--unit-distance" in told
    assert noted(lambda: TransferFunction.load(path, unit_distance=2))[1] == ""
    with pytest.raises(InputError, match="a volume must be given"):
        TransferFunction.load(path)
    with pytest.raises(InputError, match="unit distance is for files of other programs"):
        TransferFunction.load(written(tmp_path, "own.json", {"points": []}), unit_distance=2)


def slicer(colors: np.ndarray, opacities: np.ndarray, **more: Any) -> dict[str, Any]:
    names = ("x", "y", "midpoint", "sharpness")
    component = {
        "rgbTransferFunction": {"points": [{"x": row[0], "color": row[1:].tolist()} for row in colors]},
        "scalarOpacity": {"points": [dict(zip(names, row.tolist(), strict=True)) for row in opacities]},
        "scalarOpacityUnitDistance": 0.9,
        **more,
    }
    return {"volumeProperties": [{"components": [component]}]}


def test_a_volume_property_of_slicer_has_its_length_and_light(tmp_path: Path) -> None:
    colors, opacities = nodes(4, shaped=True)
    light = {"ambient": 0.1, "diffuse": 0.9, "specular": 0.2, "specularPower": 10}
    path = written(tmp_path, "v.vp.json", slicer(colors, opacities, shade=True, lighting=light))
    found, told = noted(lambda: TransferFunction.load(path))
    check(found, of_vtk(colors, opacities, "RGB"), 0.9)
    assert told == ""
    from texvol.options.looks import load_look

    lighting = load_look(str(path), CUBE).lighting
    assert lighting is not None and (lighting.ambient, lighting.diffuse, lighting.shininess) == (0.1, 0.9, 10)


def test_slicers_opacity_by_gradient_is_per_mean_spacing(tmp_path: Path) -> None:
    ramp = {"points": [{"x": 0, "y": 0.0}, {"x": 30, "y": 1.0}]}
    path = written(tmp_path, "v.vp.json", slicer(*nodes(4), gradientOpacity=ramp))
    found, told = noted(lambda: TransferFunction.load(path, CUBE))
    assert found.modulation is not None and "gradient" in told
    np.testing.assert_allclose(found.modulation, [[0, 0], [30 / 3, 1]])  # the mean of 2, 3 and 4
    always = {"points": [{"x": 0, "y": 1.0}, {"x": 255, "y": 1.0}]}
    assert (
        TransferFunction.load(written(tmp_path, "a.vp.json", slicer(*nodes(4), gradientOpacity=always))).modulation
        is None
    )


def test_the_text_of_slicer_is_per_world_unit(tmp_path: Path) -> None:
    text = "1\n1\n0.9\n0.1\n0.2\n10\n4 0 0 100 0.5\n4 0 1 255 1\n8 0 0 0 0 100 1 0.5 0\n"
    found, told = noted(lambda: TransferFunction.load(written(tmp_path, "v.vp", text)))
    colors, opacities = np.array([[0, 0, 0, 0], [100, 1, 0.5, 0]]), np.array([[0, 0, 0.5, 0], [100, 0.5, 0.5, 0]])
    check(found, of_vtk(colors, opacities, "RGB"), 1)
    assert "per 1 world unit" in told


def test_vtks_object_manager(tmp_path: Path) -> None:
    colors, opacities = nodes(5)
    color, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
    for row in colors:
        color.AddRGBPoint(*row)
    for row in opacities:
        opacity.AddPoint(*row)
    color.SetColorSpaceToLab()
    path = volume_property_file(tmp_path, color, opacity, 2.5)
    check(TransferFunction.load(path), of_vtk(colors, opacities, "Lab"), 2.5)


ITF = """<?xml version="1.0" ?><InviwoWorkspace version="2"><maskMin content="{}" /><maskMax content="1" /><Points>
<Point><pos content="0" /><rgba x="0" y="0" z="0" w="0.2" /></Point>
<Point><pos content="1" /><rgba x="1" y="1" z="1" w="0.2" /></Point></Points></InviwoWorkspace>"""


def test_inviwo_has_fractions_of_the_range_and_of_the_box(tmp_path: Path) -> None:
    found, told = noted(lambda: TransferFunction.load(written(tmp_path, "t.itf", ITF.format(0)), CUBE))
    assert (found.values[0], found.values[-1]) == (0, 59)
    mean_edge = np.linalg.norm(CUBE.box_edges, axis=0).mean()
    np.testing.assert_allclose(found.extinctions, -np.log1p(-0.2) * 150 / mean_edge)
    assert "150th" in told and "fractions of the range" in told
    masked = TransferFunction.load(written(tmp_path, "m.itf", ITF.format(0.5)), CUBE)
    assert masked.at(20.0)[3] == 0 and masked.at(40.0)[3] > 0


def test_a_colour_table_of_mricrogl(tmp_path: Path) -> None:
    text = "[FLT]\nmin={}\nmax={}\n[INT]\nnumnodes=2\n[BYT]\nnodeintensity0=0\nnodeintensity1=255\n[RGBA255]\n"
    text += "nodergba0=0|0|0|0\nnodergba1=255|0|0|128\n"
    found = TransferFunction.load(written(tmp_path, "c.clut", text.format(10, 50)), CUBE)
    assert (found.values[0], found.values[-1]) == (10, 50)
    np.testing.assert_allclose(found.extinctions[-1], -np.log1p(-128 / 255) / 2)  # of the smallest spacing
    np.testing.assert_allclose(found.colors[-1], [1, 0, 0])
    assert TransferFunction.load(written(tmp_path, "r.clut", text.format(0, 0)), CUBE).values[-1] == 59


def test_rows_of_red_green_blue_and_opacity(tmp_path: Path) -> None:
    found = TransferFunction.load(written(tmp_path, "t.1dt", "# own\n0 0 0 0\n1 1 1 0.5\n1 0 0 0.25\n"), CUBE)
    np.testing.assert_allclose(-np.expm1(-found.at([0, 29.5, 59])[:, 3]), [0, 0.5, 0.25], atol=1e-12)


def test_colours_alone_are_as_dense_as_a_colour_map(tmp_path: Path) -> None:
    content = {"ColorSpace": "RGB", "RGBPoints": [0, 0, 0, 0, 100, 1, 1, 1]}
    found, told = noted(lambda: TransferFunction.load(written(tmp_path, "m.json", content), CUBE))
    mean_edge = np.linalg.norm(CUBE.box_edges, axis=0).mean()
    np.testing.assert_allclose(found.at([50.0, 100.0])[:, 3], np.array([7.5, 30]) / mean_edge)
    assert "no opacities" in told


@pytest.mark.parametrize("low", [0, -1])
def test_colours_alone_of_no_volume_are_placed_as_paraview_does(tmp_path: Path, low: int) -> None:
    content = [{"ColorSpace": "RGB", "RGBPoints": [low, 0, 0, 0, 1, 1, 1, 1]}]
    found, told = noted(lambda: TransferFunction.load(written(tmp_path, "m.json", content), CUBE))
    assert (found.values[0], found.values[-1]) == (0, 59)
    assert "from the smallest to the largest sample" in told


BAD = {
    "three.json": ([{"RGBPoints": [0, 1, 1]}], "RGBPoints must be a list of 4 numbers for each point, got 3"),
    "none.json": ([{"RGBPoints": []}], "RGBPoints must be a list of 4 numbers for each point, got 0"),
    "text.json": ([{"RGBPoints": [0, "red", 1, 1]}], "RGBPoints must be a number, got 'red'"),
    "space.json": ([{"RGBPoints": [0, 1, 1, 1], "ColorSpace": "Oklab"}], "ColorSpace must be one of RGB, HSV"),
    "falls.vp": ("1\n0\n1\n0\n0\n1\n4 1 0 0 0\n0\n8 1 1 1 1 0 1 1 1\n", "values of colours must ascend, got 0 after 1"),
    "over.json": ([{"RGBPoints": [1, 1, 1, 7]}], "RGBPoints must be from 0 to 1, got 1 to 7"),
    "two.json": (
        [{"RGBPoints": [], "Name": "a"}, {"RGBPoints": [], "Name": "b"}],
        "has 2 colour maps, and FILE::NAME takes one: a, b",
    ),
    "list.json": ([{"IndexedColors": [1, 1, 1]}], "colour map '?' is a list of colours for categories"),
    "log.json": ([{"RGBPoints": [0, 1, 1, 1], "UseLogScale": 1}], "above 0 with UseLogScale, got 0"),
    "empty.vp.json": ({"volumeProperties": []}, "volumeProperties must be an object"),
    "part.vp.json": ({"volumeProperties": [{"components": [{}]}]}, "grayTransferFunction must be an object"),
    "state.json": ({"1": {"ClassName": "vtkVolumeProperty"}}, "RGBTransferFunction must name a state in the file"),
    "short.vp": ("1\n1\n", "must have 9 lines, got 2"),
    "count.vp": ("1\n1\n1\n1\n1\n1\n4 0 0\n\n\n", "line 7 must have 4 numbers by its first word, got 2"),
    "word.vp": ("1\none\n1\n1\n1\n1\n4 0 0\n\n\n", "line 2 must be a number, got 'one'"),
    "a.itf": ("<x>", "is not XML"),
    "b.itf": ("<x><Point><pos content='0'/></Point></x>", "each point must have pos and rgba"),
    "c.itf": ("<!DOCTYPE x [<!ENTITY a 'b'>]><x>&a;</x>", "must have no document type"),
    "a.clut": ("[INT]\nnumnodes=999999999\n", "numnodes must be from 1 to 65536"),
    "b.clut": ("[INT]\nnumnodes=1\n", "nodeintensity0 must be a number"),
    "d.clut": ("[INT]\nnumnodes=1\nnodeintensity0=1\nnodergba0=1|2|x|4", "four whole numbers R|G|B|A, got '1|2|x|4'"),
    "c.clut": ("numnodes=1", "is not a colour table of MRIcroGL"),
    "a.1dt": ("0 0 0\n0 0 0 1", "line 1 must be red, green, blue and opacity"),
    "b.1dt": ("0 0 0 1", "at least 2 lines of red, green, blue and opacity, got 1"),
    "c.1dt": ("0 0 0 nan\n0 0 0 1", "opacities must be finite"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_said_in_one_line(tmp_path: Path, name: str) -> None:
    content, reason = BAD[name]
    path = written(tmp_path, name, content)
    with pytest.raises(InputError) as caught:
        TransferFunction.load(path, CUBE)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and reason in message and "\n" not in message


def test_one_of_paraviews_colour_maps_is_taken_by_its_name(tmp_path: Path) -> None:
    colors, opacities = nodes(3)
    maps = [*paraview(colors[:2], opacities), *paraview(colors, opacities, Name="Cool, to: Warm")]
    text = json.dumps(maps).replace("}]", "},]")  # as ParaView's own list ends
    path = written(tmp_path, "maps.json", text)
    found = TransferFunction.load(f"{path}::Cool, to: Warm", unit_distance=2.5)
    check(found, of_vtk(colors, opacities, "RGB"), 2.5)
    with pytest.raises(InputError, match="'Cool to warm' not found; did you mean 'Cool, to: Warm'"):
        TransferFunction.load(f"{path}::Cool to warm", unit_distance=2.5)
    with pytest.raises(InputError, match="no list of colour maps"):
        TransferFunction.load(f"{written(tmp_path, 'own.json', {'points': []})}::own")
    from texvol.options.looks import load_look

    assert load_look(f"{path}::own", CUBE).name == "maps.json::own"


def test_hues_go_the_longer_way_in_paraview_unless_it_says_otherwise(tmp_path: Path) -> None:
    """Blue to red over green: ParaView leaves HSVWrap out where it is off, and VTK's own default is on."""
    colors = np.array([[0, 0, 0, 1], [100, 1, 0, 0]])
    opacities = np.array([[0, 0.5, 0.5, 0], [100, 0.5, 0.5, 0]])
    path = written(tmp_path, "m.json", paraview(colors, opacities, ColorSpace="HSV"))
    np.testing.assert_allclose(TransferFunction.load(path, unit_distance=1).at(50.0)[:3], [0, 1, 0], atol=LIGHT)


def test_points_out_of_order_are_sorted_as_vtk_and_slicer_do(tmp_path: Path) -> None:
    colors, opacities = nodes(3, shaped=True)
    files = {"m.json": paraview(colors[::-1], opacities[::-1]), "m.vp.json": slicer(colors[::-1], opacities[::-1])}
    for name, content in files.items():
        found = TransferFunction.load(written(tmp_path, name, content), unit_distance=2.5)
        check(found, of_vtk(colors, opacities, "RGB"), 2.5)


def test_opacities_of_two_numbers_for_each_point(tmp_path: Path) -> None:
    colors = np.array([[0, 1, 1, 1], [1, 1, 1, 1]])
    opacities = np.array([[0, 0.1], [0.3, 0.7], [0.6, 0.2], [1, 0.5]])
    path = written(tmp_path, "m.json", paraview(colors, opacities))
    found = TransferFunction.load(path, unit_distance=1)
    np.testing.assert_allclose(-np.expm1(-found.at(opacities[:, 0])[:, 3]), opacities[:, 1])


def test_what_slicer_leaves_out_is_its_default_and_told(tmp_path: Path) -> None:
    content = slicer(*nodes(4), shade=True)
    part = content["volumeProperties"][0]["components"]
    del part[0]["scalarOpacityUnitDistance"]
    part.append(part[0])
    path = written(tmp_path, "v.vp.json", content)
    found, told = noted(lambda: TransferFunction.load(path))
    check(found, of_vtk(*nodes(4), "RGB"), 1)
    assert "per 1 world unit" in told and "the first of its 2 components is taken" in told
    from texvol.options.looks import load_look

    lighting = load_look(str(path), CUBE).lighting
    assert lighting is not None and (lighting.ambient, lighting.diffuse, lighting.shininess) == (0.1, 0.7, 10)


def test_slicers_opacity_by_gradient_may_begin_below_0_and_have_steps(tmp_path: Path) -> None:
    points = [{"x": -10, "y": 0.0}, {"x": 10, "y": 1.0}, {"x": 30, "y": 1.0}, {"x": 30, "y": 0.2}, {"x": 60, "y": 0.2}]
    path = written(tmp_path, "v.vp.json", slicer(*nodes(4), gradientOpacity={"points": points}))
    modulation = TransferFunction.load(path, CUBE).modulation
    assert modulation is not None
    magnitudes = np.array([0, 5, 20, 31, 50])
    factors = np.interp(magnitudes / 3, *modulation.T)  # the mean of 2, 3 and 4
    np.testing.assert_allclose(factors, [0.5, 0.75, 1, 0.2, 0.2], rtol=1e-6)


def test_mricrogl_moves_the_last_node_and_ends_bytes_at_255(tmp_path: Path) -> None:
    text = "[FLT]\nmin=0\nmax=51\n[INT]\nnumnodes=2\n[BYT]\nnodeintensity0=0\nnodeintensity1=200\n[RGBA255]\n"
    text += "nodergba0=0|0|0|0|\nnodergba1=000|256|0|128\n"
    found = TransferFunction.load(written(tmp_path, "c.clut", text), CUBE)
    assert found.values[-1] == 51
    np.testing.assert_allclose(found.colors[-1], [0, 1, 0])


OWN = TransferFunction(
    np.array([0.0, 20, 20, 60, 80, 100]),
    np.array([[0, 0, 0], [0.2, 0.1, 0.6], [0.9, 0.2, 0], [0.1, 0.8, 0.3], [1, 1, 1], [1, 1, 1]]),
    np.array([0.0, 0.3, 1.2, 0.05, 2.0, 0.0]),
    name="own",
)


@pytest.mark.parametrize("form", ["map.json", "own.vp.json", "own.vp"])
def test_what_is_written_is_read_again_by_vtks_rules(tmp_path: Path, form: str) -> None:
    unit = 1.0 if form == "own.vp" else 1.7
    texts = {
        "map.json": lambda: writing.paraview(OWN, unit, "own"),
        "own.vp.json": lambda: writing.slicer(OWN, unit, None),
        "own.vp": lambda: writing.slicer_text(OWN, None),
    }
    text, count = texts[form]()
    found = TransferFunction.load(written(tmp_path, form, text), unit_distance=unit if form == "map.json" else None)
    numbers = OWN.at(VALUES)
    # Twice the tolerance: once written, once read.
    assert np.abs(np.exp(-found.at(VALUES)[:, 3] * unit) - np.exp(-numbers[:, 3] * unit)).max() < 2 * OPACITY
    shown = numbers[:, 3] > 0
    assert np.abs(found.at(VALUES) - numbers)[shown, :3].max() < 2 * LIGHT
    assert count < 200


def test_what_other_programs_cannot_say_is_refused() -> None:
    glowing = TransferFunction(np.array([0.0, 1]), np.ones((2, 3)), np.zeros(2), emissive=True)
    with pytest.raises(InputError, match="emits more than it absorbs"):
        writing.paraview(glowing, 1.0, "own")
    graded = TransferFunction(np.array([0.0, 1]), np.ones((2, 3)), np.ones(2), modulation=np.array([[0, 0], [1, 1]]))
    with pytest.raises(InputError, match="depends on the gradient"):
        writing.slicer(graded, 1.0, None)


def test_colour_maps_by_any_name_of_the_library() -> None:
    from cmap import Colormap

    from texvol.scene.transfer import preset

    for name in ("batlow", "cmocean:thermal", "turbo"):
        found = preset(name, CUBE)
        low, high = found.values[0], found.values[-1]
        wanted = linear_from_srgb(np.asarray(Colormap(name).lut(1025))[:, :3])
        fractions = np.linspace(0, 1, 1025)
        assert np.abs(found.at(low + fractions * (high - low))[:, :3] - wanted).max() < LIGHT
    with pytest.raises(InputError, match="colour map tab20 must be a ramp, got a list of colours"):
        preset("tab20", CUBE)
    with pytest.raises(InputError, match="preset 'batlov' not found"):
        preset("batlov", CUBE)
