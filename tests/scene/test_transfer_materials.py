"""Materials: shares of a mixture, exact as points; boundaries, contours, units; and what is wrong in a file."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from texvol.scene import transfer
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

LEFT, RIGHT = (0.9, 0.6, 0.1), (0.2, 0.3, 1.0)
FAT = {"name": "fat", "from": [0, 10], "to": [30, 50], "color": list(LEFT), "extinction": 0.5}
BONE = {"name": "bone", "from": [40, 80], "color": list(RIGHT), "extinction": 4}
AIR = {"name": "air", "to": 5, "color": [0, 0, 0], "extinction": 0}
VOLUME = Volume(np.arange(1000, dtype=np.float32).reshape(10, 10, 10), (2.0, 1.0, 4.0))


def loads(content: dict[str, Any], volume: Volume | None = None, materials: Any = None) -> TransferFunction:
    return transfer.loads(json.dumps(content), "materials.json", volume, materials)


def fraction(material: dict[str, Any], value: float) -> float:
    """The percentage of Drebin, Carpenter, Hanrahan 1988, a case at a time."""
    for key, rising in (("from", True), ("to", False)):
        if key not in material:
            continue
        low, high = material[key] if isinstance(material[key], list) else [material[key]] * 2
        if value >= high:
            part = 1.0
        elif value < low or low == high:
            part = 0.0
        else:
            part = (value - low) / (high - low)
        if rising and part < 1:
            return part
        if not rising and part > 0:
            return 1 - part
    return 1.0


def random_materials(seed: int, count: int = 5) -> list[dict[str, Any]]:
    random = np.random.default_rng(seed)
    found: list[dict[str, Any]] = []
    for number in range(count):
        a, b, c, d = np.sort(random.integers(0, 200, 4)).tolist()
        if a == d or b == c == d:
            d += 1
        material = {"name": f"{number}", "from": [a, b], "to": [c, d]}
        kind = random.integers(5)
        if kind == 0:
            del material["from"]
        elif kind == 1:
            del material["to"]
        elif kind == 2:
            material |= {"from": b, "to": max(c, b + 1)}
        color, extinction = random.random(3).tolist(), float(random.uniform(0, 5))
        found.append(material | {"color": color, "extinction": extinction})
    return found


@pytest.mark.parametrize("seed", range(20))
def test_a_value_shows_its_shares_of_all_materials(seed: int) -> None:
    materials = random_materials(seed)
    function = loads({"materials": materials})
    assert function.premultiplied
    assert function.materials == tuple("01234")
    values = np.append(np.random.default_rng(seed).uniform(-20, 220, 500), np.arange(-5, 205))
    emission, extinction = function.classify(values)
    for value, q, tau in zip(values, emission, extinction, strict=True):
        fractions = [fraction(each, value) for each in materials]
        assert tau == pytest.approx(
            sum(s * m["extinction"] for s, m in zip(fractions, materials, strict=True)), abs=1e-12
        )
        glow = sum(s * m["extinction"] * np.array(m["color"]) for s, m in zip(fractions, materials, strict=True))
        np.testing.assert_allclose(q, glow, atol=1e-12)


def test_an_open_end_holds_to_infinity() -> None:
    function = loads({"materials": [AIR | {"extinction": 1}, BONE]})
    np.testing.assert_allclose(function.classify([-np.inf, -1e300, 1e300, np.inf]).extinction, [1, 1, 4, 4])


def test_a_value_on_a_step_belongs_to_what_begins_there() -> None:
    labels = [{"name": str(n), "from": n, "to": n + 1, "color": [0, 0, 0], "extinction": n} for n in (3, 4)]
    found = loads({"materials": labels}).classify([2, 3, 3.9, 4, 4.9, 5]).extinction
    np.testing.assert_array_equal(found, [0, 3, 3, 4, 4, 0])


def test_a_material_with_a_gradient_is_graded() -> None:
    function = loads({"materials": [FAT, BONE | {"gradient": [2, 6]}]})
    fat = loads({"materials": [FAT]})
    assert len(function.graded) == 1
    values = np.array([0, 45, 60, 80, 1e30])
    for magnitude, weight in ((0, 0), (2, 0), (4, 0.5), (6, 1), (9, 1)):
        emission, extinction = function.classify(values, np.full(5, float(magnitude)))
        bone = np.array([fraction(BONE, value) for value in values]) * 4 * weight
        np.testing.assert_allclose(extinction, fat.classify(values).extinction + bone, atol=1e-12)
        np.testing.assert_allclose(emission, fat.classify(values).emission + np.outer(bone, RIGHT), atol=1e-12)


def test_an_opaque_material_hides_all_where_it_has_any_share() -> None:
    opaque = {key: each for key, each in FAT.items() if key != "extinction"} | {"opacity": 1}
    haze = {"name": "haze", "to": [20, 60], "color": list(RIGHT), "extinction": 2}
    emission, extinction = loads({"materials": [opaque, haze]}).classify([-1, 0, 1, 20, 49, 50, 60])
    np.testing.assert_allclose(extinction, [2, 2, np.inf, np.inf, np.inf, 0.5, 0])
    np.testing.assert_allclose(emission[2:5], [LEFT] * 3)  # its own colour, however little its share
    np.testing.assert_allclose(emission[[0, 1, 5]], np.outer([2, 2, 0.5], RIGHT))


def test_of_several_opaque_materials_the_mean_shows_weighted_by_share() -> None:
    one = {"name": "one", "to": [0, 10], "color": [1, 0, 0], "opacity": 1}
    other = {"name": "other", "from": [5, 15], "color": [0, 1, 0], "opacity": 1}
    emission, extinction = loads({"materials": [one, other]}).classify([-1, 5, 10, 20])
    assert np.isinf(extinction).all()
    # At 5 the other's share is 0 still; at 10 the one's is 0 again.
    np.testing.assert_allclose(emission, [[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]])
    even = loads({"materials": [one | {"to": 10}, other | {"from": 5}, other | {"name": "third", "from": 5}]})
    np.testing.assert_allclose(even.classify([7]).emission, [[1 / 3, 2 / 3, 0]])


POINTS = [
    {"value": -10, "color": [0, 0, 0], "extinction": 0},
    {"value": 25, "color": [1, 0.5, 0.25], "extinction": 2},
    {"value": 25, "color": [0, 0, 1], "extinction": 3},
    {"value": 90, "color": [0, 1, 0], "extinction": 1},
]


def test_points_and_materials_add_up() -> None:
    both = loads({"points": POINTS, "materials": [FAT, BONE]})
    points, materials = loads({"points": POINTS}), loads({"materials": [FAT, BONE]})
    values = np.append(np.linspace(-30, 120, 1001), 25)
    one, other, found = (each.classify(values) for each in (points, materials, both))
    np.testing.assert_allclose(found.extinction, one.extinction + other.extinction, atol=1e-12)
    # A line for each 32nd of a parabola: off by (change of colour 1) (change of extinction 2) / 4 / 32² at most.
    np.testing.assert_allclose(found.emission, one.emission + other.emission, atol=5e-4)
    assert np.abs(found.emission - one.emission - other.emission).max() > 1e-5


@pytest.mark.parametrize("fixed", ["color", "premultiplied"])
def test_points_whose_emission_is_linear_add_up_exactly(fixed: str) -> None:
    if fixed == "color":
        content = {"points": [point | {"color": [0.5, 0.25, 1]} for point in POINTS]}
    else:
        glowing = [{"value": p["value"], "emission": p["color"], "extinction": p["extinction"]} for p in POINTS]
        content = {"points": glowing, "emission": "premultiplied"}
    values = np.append(np.linspace(-30, 120, 1001), 25)
    found, one, other = (
        loads(each).classify(values) for each in (content | {"materials": [FAT]}, content, {"materials": [FAT]})
    )
    np.testing.assert_allclose(found.emission, one.emission + other.emission, atol=1e-12)
    assert len(loads(content | {"materials": [FAT]}).values) < 12


def test_opaque_points_stay_opaque_beside_materials() -> None:
    points = [
        {"value": 0, "color": [1, 0, 0], "extinction": 1},
        {"value": 20, "color": [0, 1, 0], "opacity": 1},
        {"value": 40, "color": [0, 0, 1], "extinction": 1},
    ]
    emission, extinction = loads({"points": points, "materials": [BONE]}).classify([-1, 0, 1, 20, 39, 40, 60])
    np.testing.assert_allclose(extinction, [1, 1, np.inf, np.inf, np.inf, 1, 1 + 2])
    np.testing.assert_allclose(emission[[1, 3, 5]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-12)
    # Where the colour goes linearly from red to green: 1 / 20 of the way, less what the ramp begins later.
    np.testing.assert_allclose(emission[2], [0.95, 0.05, 0], atol=1e-4)


def test_a_boundary_goes_from_one_typical_value_to_the_next() -> None:
    content = {
        "materials": [AIR, FAT, BONE],
        "show": [],
        "boundaries": [{"materials": ["air", "fat", "bone"], "gradient": 8}],
    }
    function = loads(content)
    assert function.materials == ("air", "fat", "bone")
    # Air ends at 5, fat is alone from 10 to 30, and bone from 80 on.
    values = np.array([4, 5, 12.5, 20, 50, 80, 81])
    tau = np.array([0, 0, 0.25, 0.5, 2.25, 4, 0])
    for magnitude, weight in ((0, 0), (2, 0.25), (8, 1), (20, 1)):
        emission, extinction = function.classify(values, np.full(7, float(magnitude)))
        np.testing.assert_allclose(extinction, weight * tau, atol=1e-12)
        middle = 0.25 * np.array(LEFT) + 2 * np.array(RIGHT)
        expected = [0.5 * np.array(LEFT), middle, 4 * np.array(RIGHT)]
        np.testing.assert_allclose(emission[3:6], weight * np.array(expected), atol=1e-12)


def test_a_contour_has_its_thickness_in_voxels_and_may_take_a_materials_matter() -> None:
    entry = {"value": 7, "thickness": 3, "color": [1, 0.5, 0], "opacity": 0.5}
    own = loads({"contours": [entry]}, VOLUME).contours[0]
    of_bone = {"value": 7, "thickness": 3, "material": "bone"}
    taken = loads({"materials": [BONE], "show": [], "contours": [of_bone]}, VOLUME).contours[0]
    assert own.value == taken.value == 7
    assert own.thickness == taken.thickness == 3 * 1.0
    assert own.extinction == pytest.approx(np.log(2))
    np.testing.assert_allclose(own.emission, np.log(2) * np.array([1, 0.5, 0]))
    assert taken.extinction == 4
    np.testing.assert_allclose(taken.emission, 4 * np.array(RIGHT))
    assert loads({"contours": [entry]}, Volume(np.zeros((2, 2, 2)), (5, 6, 7))).contours[0].thickness == 15


def test_only_some_materials_show() -> None:
    content = {"materials": [AIR, FAT, BONE | {"gradient": [0, 1]}]}
    fat = loads(content, materials=["fat"])
    assert fat.materials == ("fat",) and not fat.needs_gradient
    np.testing.assert_array_equal(fat.classify([20, 100]).extinction, [0.5, 0])
    assert loads(content, materials=("bone", "air")).materials == ("air", "bone")
    assert loads(content | {"show": ["fat"]}).materials == ("fat",)
    assert loads(content | {"show": ["fat"]}, materials=["bone"]).materials == ("bone",)
    contour = {"contours": [{"value": 1, "world_thickness": 1, "material": "bone"}]}
    assert loads(content | contour, materials=["fat"]).materials == ("fat", "bone")
    for preset in ("table-5-1", "ct-tissues", "ct-materials", "mr-materials", "histogram"):
        names = transfer.preset(preset, VOLUME).materials
        assert transfer.preset(preset, VOLUME, materials=names[-1:]).materials == names[-1:]


def test_the_gradient_modulates_points_and_materials_without_one() -> None:
    content = {"materials": [FAT, BONE | {"gradient": [0, 0]}], "gradient": [[0, 0], [10, 1]]}
    extinction = loads(content).classify([20, 20, 100], [5, 10, 5]).extinction
    np.testing.assert_allclose(extinction, [0.25, 0.5, 4])


def test_all_units_may_be_relative_to_the_volume() -> None:
    content = {
        "values": "range",
        "length": "box",
        "gradients": "relative",
        "materials": [FAT | {"from": 0.1, "to": [0.5, 0.6]}, BONE | {"from": 0.7, "gradient": [0.1, 0.2]}],
        "contours": [{"value": 0.5, "thickness": 1, "color": [1, 1, 1], "extinction": 20}],
        "boundaries": [{"materials": ["fat", "bone"], "gradient": 0.5}],
        "graded": [{"points": [{"value": 1, "emission": [1, 2, 3], "extinction": 20}], "gradient": [0, 1]}],
        "gradient": [[0, 1], [1, 0]],
    }
    function = loads(content, VOLUME)
    edge = (20 + 10 + 40) / 3
    np.testing.assert_allclose(function.values, [99.9, 99.9, 499.5, 599.4])
    np.testing.assert_allclose(function.extinctions, np.array([0, 0.5, 0.5, 0]) / edge)
    bone, own, between = function.graded[0], function.graded[2], function.graded[1]
    assert (bone.start, bone.full) == pytest.approx((99.9, 199.8))  # the range is 999 and the spacing 1
    assert bone.extinctions.max() == pytest.approx(4 / edge)
    assert between.full == pytest.approx(499.5)
    np.testing.assert_allclose(between.values, [(99.9 + 499.5) / 2, 699.3])
    np.testing.assert_allclose(own.emissions, [np.array([1, 2, 3]) / edge])
    assert own.full == 999
    assert function.contours[0].value == 499.5
    assert function.contours[0].extinction == pytest.approx(20 / edge)
    np.testing.assert_allclose(function.modulation, [[0, 1], [999, 0]])
    coarse = Volume(VOLUME.values, (4.0, 2.0, 8.0))
    assert loads(content, coarse).graded[0].full == pytest.approx(99.9)
    percent = loads({"values": "percentile", "materials": [BONE | {"from": [50, 100]}]}, VOLUME)
    np.testing.assert_allclose(percent.values, [499.5, 999])
    points = [
        {"value": 0, "emission": [4, 5, 6], "extinction": 7},
        {"value": 1, "color": [1, 0, 0], "opacity": 1},
    ]
    premultiplied = {"length": "box", "emission": "premultiplied", "points": points}
    np.testing.assert_allclose(loads(premultiplied, VOLUME).colors, [np.array([4, 5, 6]) / edge, [1, 0, 0]])


def test_a_function_of_graded_matter_alone_has_a_point_of_nothing() -> None:
    for content in ({"materials": [BONE | {"gradient": [0, 1]}]}, {"materials": [BONE], "show": []}):
        function = loads(content)
        np.testing.assert_array_equal(function.extinctions, [0])
        assert not function.classify(100.0, 0.0).extinction


def test_materials_survive_json() -> None:
    content = {
        "materials": [FAT | {"opacity": 1} | {}, BONE | {"gradient": [0, 1]}],
        "contours": [{"value": 1, "world_thickness": 1, "material": "bone"}],
        "gradient": [[0, 0], [1, 1]],
    }
    del content["materials"][0]["extinction"]  # type: ignore[attr-defined]
    function = loads(content)
    again = loads(function.as_json())
    random = np.random.default_rng(0)
    values, magnitudes = random.uniform(-10, 100, 500), random.uniform(0, 2, 500)
    for one, other in zip(function.classify(values, magnitudes), again.classify(values, magnitudes), strict=True):
        np.testing.assert_array_equal(one, other)
    assert again.materials == function.materials == ("fat", "bone")


def _material(**changes: Any) -> dict[str, Any]:
    return {"materials": [{key: each for key, each in (FAT | changes).items() if each is not None}]}


def _contour(**changes: Any) -> dict[str, Any]:
    entry = {"value": 1, "world_thickness": 1, "color": [1, 1, 1], "extinction": 1} | changes
    return {"materials": [FAT], "contours": [{key: each for key, each in entry.items() if each is not None}]}


def _boundary(**changes: Any) -> dict[str, Any]:
    entry = {"materials": ["fat", "bone"], "gradient": 1} | changes
    return {"materials": [FAT, BONE], "boundaries": [{key: each for key, each in entry.items() if each is not None}]}


def _graded(**changes: Any) -> dict[str, Any]:
    point = {"value": 0, "emission": [0, 0, 0], "extinction": 0}
    return {"graded": [{"points": [point | changes.pop("point", {})], "gradient": [0, 1]} | changes]}


@pytest.mark.parametrize(
    "content, message",
    [
        ({"materials": []}, "a transfer function must have a list of materials with at least one"),
        ({"materials": {}}, "a transfer function must have a list of materials with at least one"),
        ({"materials": [3]}, "material 0 must be an object with name, from, to, color and extinction, got 3"),
        (_material(name=None), "material 0 must have a name without a comma, got None"),
        (_material(name="a,b"), "must have a name without a comma, got 'a,b'"),
        (_material(colour=1), "material 0: key 'colour' not known; known are color, extinction, from, gradient, name,"),
        (_material(color=None), "material 'fat' must have color"),
        (_material(color=[0, 0, 2]), r"material 'fat': color must be from 0 to 1, got \[0.0, 0.0, 2.0\]"),
        (_material(color=[0, 0, -1]), r"material 'fat': color must be from 0 to 1"),
        (_material(extinction=-1), "material 'fat': extinction must not be negative or NaN, got -1"),
        (_material(opacity=0.5), "material 'fat' must have either extinction or opacity, got both"),
        (_material(**{"from": [10, 0]}), r"material 'fat': from must be a number or two that ascend, got \[10, 0\]"),
        (_material(**{"from": [0, 1, 2]}), r"material 'fat': from must be a number or two that ascend"),
        (_material(**{"from": "0"}), "from must be a number, got '0'"),
        (_material(**{"from": [0, np.nan]}), r"material 'fat': from must be a number or two that ascend"),
        (_material(to=[5, 50]), "material 'fat': to must come after from, got to at 5 and from up to 10"),
        (_material(**{"from": 3, "to": 3}), "material 'fat': to must come after from"),
        (_material(gradient=[1, 0]), "material 'fat': gradient must be two gradient magnitudes from 0 upwards that"),
        (_material(gradient=[-1, 0]), "two gradient magnitudes"),
        (_material(gradient=3), "two gradient magnitudes"),
        (_material(gradient=[0, 1], extinction=None, opacity=1), "material 'fat': opacity must be below 1 if the"),
        ({"materials": [FAT, FAT]}, "material 'fat' must be defined once, got it twice"),
        ({"materials": [FAT], "show": ["bones"]}, "material 'bones' not found; known are fat"),
        ({"materials": [FAT], "show": "fat"}, "show must be a list of names of materials, got 'fat'"),
        ({"materials": [FAT], "points": [{"value": 0, "emission": [0, 0, 0], "extinction": 0}], "emission": "emissive"},
         "emissive points must not be combined with materials, whose emission is colour times"),
        ({"contours": []}, "a transfer function must have a list of contours with at least one"),
        (_contour(thickness=1), "contour 0 must have exactly one of thickness and world_thickness"),
        (_contour(world_thickness=None), "contour 0 must have exactly one of thickness and world_thickness"),
        (_contour(world_thickness=0), "contour 0: world_thickness must be a finite number above 0, got 0"),
        (_contour(world_thickness=-1), "finite number above 0"),
        (_contour(world_thickness=None, thickness=1), r"a volume must be given, load\(path, volume\), since the"),
        (_contour(value=None), "contour 0 must have value"),
        (_contour(value=np.inf), "contour 0: value must be finite"),
        (_contour(value=1e308), r"contour: value must be finite and at most 8e\+307 in size"),
        (_contour(extinction=None, opacity=1), "contour 0: opacity must be below 1 if the medium depends on the"),
        (_contour(extinction=None), "contour 0 must have either extinction or opacity, got both"),
        (_contour(color=None), "contour 0 must have color or emission"),
        (_contour(emission=[1, 1, 1]), "contour 0 must have either color or emission, got both"),
        (_contour(color=[2, 0, 0]), r"contour 0: color must be from 0 to 1, got \[2.0, 0.0, 0.0\]"),
        (_contour(material="fat"), "contour 0 must have either a material, or a colour and an extinction of its own"),
        (_contour(material="skin", color=None, extinction=None), "material 'skin' not found; known are fat"),
        (_contour(radius=1), "contour 0: key 'radius' not known; known are color, emission, extinction, material,"),
        ({"boundaries": []}, "a transfer function must have a list of boundaries with at least one"),
        (_boundary(materials=["fat"]), "boundary 0 must have a list of at least two names of materials"),
        (_boundary(materials=["fat", "skin"]), "material 'skin' not found; known are fat, bone"),
        (_boundary(materials=["fat", ["bone"]]), r"material \['bone'\] not found; known are fat, bone"),
        (_boundary(materials=["bone", "fat"]), r"boundary 0: the materials must go from low to high values, got"),
        (_boundary(gradient=0), "boundary 0: gradient must be a finite number above 0, got 0"),
        (_boundary(gradient=None), "boundary 0 must have gradient"),
        ({"boundaries": [{"materials": ["a", "b"], "gradient": 1}]}, "material 'a' not found; known are none"),
        ({"materials": [FAT, {"name": "all", "color": [0, 0, 0], "extinction": 1}],
          "boundaries": [{"materials": ["fat", "all"], "gradient": 1}]}, "boundary 0: material 'all' must have"),
        ({"materials": [FAT, {"name": "wall", "from": 90, "color": [0, 0, 0], "opacity": 1}],
          "boundaries": [{"materials": ["fat", "wall"], "gradient": 1}]}, "boundary 0: material 'wall' must not be"),
        ({"graded": []}, "a transfer function must have a list of graded with at least one"),
        (_graded(gradient=[0]), r"graded 0: gradient must be two gradient magnitudes from 0 upwards that ascend,"),
        (_graded(points=[]), "must have a list of points"),
        (_graded(point={"extinction": -1}), "graded 0, point 0: extinction must not be negative"),
        (_graded(point={"emission": [-1, 0, 0]}), "graded 0: .*emission must be finite and not negative"),
        ({"materials": [FAT], "gradient": []}, r"gradient must be a list of pairs \[magnitude, factor\], got \[\]"),
        ({"materials": [FAT], "gradient": [[0]]}, r"gradient: entry 0 must be a pair \[magnitude, factor\], got \[0\]"),
        ({"materials": [FAT], "gradient": [[1, 0], [0, 1]]}, "gradient magnitudes must ascend, got 0 after 1"),
        ({"materials": [FAT], "gradient": [[0, -1]]}, "must be finite and not negative"),
        ({"materials": [FAT], "gradients": "steep"}, '"gradients" must be one of data, relative'),
        ({"values": "percentile", "materials": [BONE | {"from": 101}]}, "percentiles must be from 0 to 100"),
        ({"points": [{"value": 0, "emission": [0, 0, 0], "opacity": 1}], "emission": "premultiplied"},
         "point 0: an opaque point must have color in place of emission"),
        ({"material_names": "fat", "points": POINTS}, "material_names must be a list of names of materials, got 'fat'"),
        ({"show": []}, "must have a list of points, materials"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_file_is_said_in_one_line(content: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        loads(content)
    assert str(caught.value).startswith("materials.json: ")
    assert "\n" not in str(caught.value)


def test_materials_that_are_not_there_are_refused_with_the_list() -> None:
    with pytest.raises(InputError, match="material 'bones' not found; known are air, fat, bone"):
        loads({"materials": [AIR, FAT, BONE]}, materials=["bones"])
    with pytest.raises(InputError, match="materials 'bone' not found: the file has none"):
        loads({"points": POINTS}, materials=["bone"])
    with pytest.raises(InputError, match="material 'bones' not found; known are air, fat, soft tissue, bone"):
        transfer.preset("ct-tissues", VOLUME, ["bones"])
    with pytest.raises(InputError, match="the preset ct-bone has none"):
        transfer.preset("ct-bone", VOLUME, ["bone"])
