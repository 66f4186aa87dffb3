"""Text, round numbers, and what annotation costs where it is not asked for."""

from __future__ import annotations

import re
import sys
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.annotated import blank, crooked
from support.processes import imported_by

from texvol.annotation import PARTS, Annotation, annotate, check, rounding
from texvol.annotation.drawing import place_all
from texvol.annotation.lettering import Lettering, one_line
from texvol.scene.scene import Scene
from texvol.util.errors import InputError, MissingExtraError
from texvol.util.installation import install_command

SIZE = (300, 200)


def test_all_letters_of_units_and_numbers_are_there() -> None:
    letters = Lettering()
    letters.check("µm² μm³ 45° × 10⁻⁹⁰¹²³⁴⁵⁶⁷⁸ Å −1 ± … → ≤ ∞ Ωé", "test")
    shapes = [letters.coverage(letter, 24)[0] for letter in "µ²°×Å−"]
    assert all(shape.max() > 0.9 for shape in shapes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("heart 心", "title: the font DejaVu Sans has no letter '心' \\(U\\+5FC3\\); choose another font"),
        ("\x07", "has no letter '\\\\x07'"),
        ("\ud83d", "has no letter"),
        ("שלום", "is written from right to left"),
    ],
)
def test_letters_that_cannot_be_drawn_are_refused_by_name(text: str, message: str) -> None:
    asked = Annotation(title=text)
    with pytest.raises(InputError, match=message):
        check(asked, Scene(crooked(), classification="slab"))
    with pytest.raises(InputError, match=message):
        annotate(np.zeros((200, 300, 4)), Scene(crooked(), classification="slab"), SIZE, asked)


def test_units_and_names_of_files_are_checked_too() -> None:
    scene = Scene(crooked(unit="尺"), classification="slab")
    for parts in ({"axes": True}, {"scale_bar": True}, {"legend": True}):
        with pytest.raises(InputError, match="no letter '尺'"):
            annotate(np.zeros((200, 300, 4)), scene, SIZE, Annotation(**parts))
    annotate(np.zeros((200, 300, 4)), scene, SIZE, Annotation(box=True))


def test_letters_are_composed_and_stand_on_one_line() -> None:
    assert one_line("Scha\u0308del \n 2\u200d") == "Schädel 2"


def test_another_font_may_be_given(tmp_path: Path) -> None:
    import matplotlib

    other = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSerif.ttf"
    scene, empty = Scene(crooked(), classification="slab"), np.zeros((200, 300, 4))
    pictures = [annotate(empty, scene, SIZE, Annotation(title="Title", font=font)) for font in (None, other)]
    assert (pictures[0] != pictures[1]).any()
    (tmp_path / "no.ttf").write_text("no font")
    for name in ("no.ttf", "absent.ttf"):
        with pytest.raises(InputError, match=f"{name}: cannot be read"):
            check(Annotation(title="Title", font=tmp_path / name), scene)


def test_a_font_whose_letters_are_damaged_is_refused(tmp_path: Path) -> None:
    """FreeType opens it, and fails at the first outline."""
    import matplotlib

    sound = (Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "cmtt10.ttf").read_bytes()
    tables = {sound[at : at + 4]: at for at in range(12, 12 + 16 * int.from_bytes(sound[4:6]), 16)}
    begin, length = (int.from_bytes(sound[tables[b"glyf"] + at :][:4]) for at in (8, 12))
    damaged = tmp_path / "damaged.ttf"
    damaged.write_bytes(sound[:begin] + b"\x7f" * length + sound[begin + length :])
    with pytest.raises(InputError, match="damaged.ttf: cannot be read as a font"):
        check(Annotation(title="Title", font=damaged), Scene(crooked(), classification="slab"))


@pytest.mark.parametrize("missing", ["PIL", "matplotlib"])
def test_a_missing_library_is_named_with_its_extra(missing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(MissingExtraError, match=re.escape(install_command("annotation"))):
        check(Annotation(box=True), Scene(crooked(), classification="slab"))


@pytest.mark.parametrize("letters", [5, 30, 45, 400, 100_000])
def test_a_title_is_shrunk_and_then_cut(letters: int) -> None:
    scene = Scene(crooked(), classification="slab")
    sheet, view = blank(scene, SIZE)
    place_all(sheet, view, scene, Annotation(title="ab " * (letters // 3)), None)
    (text,), (rect,) = sheet.texts, sheet.written
    assert rect.left >= 0
    assert rect.right <= SIZE[0]
    if letters > 45:
        assert text.endswith("…")
        assert rect.right - rect.left > 0.8 * SIZE[0]
    else:
        assert text == ("ab " * (letters // 3)).strip()


def test_what_is_asked_for_is_checked() -> None:
    assert Annotation.of(["box", "scale-bar"], "T") == Annotation(box=True, scale_bar=True, title="T")
    assert [bool(Annotation.of([part])) for part in PARTS] == [True] * len(PARTS)
    assert not Annotation()
    assert not Annotation(title="  ", value_name="HU")
    with pytest.raises(InputError, match="part must be one of box, axes, orientation, legend, scale-bar, got 'boxes'"):
        Annotation.of(["boxes"])
    for wrong in ({"color": (1, 2, 0)}, {"color": "red"}, {"font_size": 0}, {"font_size": np.nan}, {"title": 3},
                  {"value_name": None}):  # fmt: skip
        with pytest.raises(InputError, match="annotation: "):
            Annotation(**wrong)  # type: ignore[arg-type]


def test_what_is_not_asked_for_is_not_imported(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np\n"
        "from texvol.annotation import Annotation, annotate, check, with_room\n"
        "from texvol.scene.scene import Scene\n"
        "from texvol.scene.volume import Volume\n"
        "scene, picture = Scene(Volume(np.zeros((8, 8, 8)))), np.zeros((8, 8, 4), np.float32)\n"
        "check(Annotation(), scene)\n"
        "camera = scene.completed((8, 8)).camera\n"
        "assert with_room(camera, scene, (8, 8), Annotation()) is camera\n"
        "assert annotate(picture, scene, (8, 8), Annotation()) is picture\n"
        "assert not any(name.startswith('texvol.annotation.draw') for name in sys.modules)"
    )
    assert not imported_by(code, tmp_path) & {"PIL", "matplotlib"}


@given(st.floats(1e-200, 1e200))
def test_round_numbers_are_1_2_or_5_and_next_to_what_is_asked(number: float) -> None:
    above, below = rounding.round_up(number), rounding.round_down(number)
    assert {each.as_tuple().digits[0] for each in (above, below)} <= {1, 2, 5}
    assert all(not any(each.as_tuple().digits[1:]) for each in (above, below))
    assert number * (1 - 1e-8) <= float(above) < 2.5 * number * (1 + 1e-8)
    assert number / 2.5 * (1 - 1e-8) < float(below) <= number * (1 + 1e-8)
    assert 1.9 < float(rounding.round_up(float(above) * 1.5) / above) < 2.6


@pytest.mark.parametrize(
    ("low", "high", "step", "texts", "factor"),
    [
        (-0.3, 0.3, "0.1", ["−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3"], ""),
        (0, 150, "50", ["0", "50", "100", "150"], ""),
        (1e9, 1e9 + 2, "1", ["1.000000000", "1.000000001", "1.000000002"], "×10⁹"),
        (0, 2.5e-9, "1E-9", ["0", "1", "2"], "×10⁻⁹"),
        (-2e5, 0, "1E5", ["−200", "−100", "0"], "×10³"),
    ],
)
def test_numbers_are_written_with_the_digits_that_tell_them_apart(
    low: float, high: float, step: str, texts: list[str], factor: str
) -> None:
    values = rounding.multiples(low, high, Decimal(step))
    assert rounding.written(values, Decimal(step)) == (texts, factor)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.1 + 0.2, "0.3"),
        (61711.0, "61711"),
        (-1e-30, "−1×10⁻³⁰"),
        (0.0, "0"),
        (-0.0, "0"),
        (np.inf, "∞"),
        (1e6, "1×10⁶"),
    ],
)
def test_a_number_alone_has_its_own_digits(number: float, text: str) -> None:
    assert rounding.plain(number) == text


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (9999.4, "9999"),
        (74558.0, "74,558"),
        (135275.3, "135,275"),
        (-46208569.5, "−46,208,570"),
        (2e9, "2×10⁹"),
        (np.nan, "?"),
    ],
)
def test_measured_values_are_written_in_one_way_from_thousands_to_millions(number: float, text: str) -> None:
    assert rounding.grouped(number, 4) == text


def test_lengths_have_their_unit() -> None:
    assert rounding.length(Decimal("5E+1"), "mm") == "50 mm"
    assert rounding.length(Decimal("2E-9"), "") == "2×10⁻⁹ world units"


def test_a_text_that_is_cut_at_a_point_has_no_further_points() -> None:
    letters = Lettering()
    width = letters.box("a file.", 12).width + letters.box("…", 12).width
    assert letters.fitted("a file.ome.tif", 12, width, 1.0) == ("a file…", 12)
