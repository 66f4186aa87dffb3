"""Tables of labels: names and colours of each form, refusal of other texts, and files beside volumes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import texvol
from texvol.formats.label_tables import label_table_beside, read_label_table
from texvol.scene.label_names import names_of, table_of
from texvol.util.color import srgb_from_linear
from texvol.util.errors import InputError

# The same three labels, red, green and blue, in each form; a name has blanks, a digit or an accent.
FORMS = {
    "itk-snap": """
# ITK-SnAP Label Description File
    0     0    0    0        0  0  0    "Clear Label"
    1   255    0    0        1  1  1    "left lobe 2"
    2     0  255    0      0.5  1  0    "Nerf médian"
    7     0    0  255        1  1  1    "7th nerve"
""",
    "freesurfer": "#No. Name R G B A\n\n1   left lobe 2  255 0 0 0\n2 Nerf médian\t0 255 0 0\n7 7th nerve 0 0 255 0\n",
    "ctbl": "# Color table file\n1 left lobe 2 255 0 0 255\n2 Nerf médian 0 255 0 255\n7 7th nerve 0 0 255 255\n",
    "csv": "label,name,r,g,b\n1,left lobe 2,255,0,0\n2,Nerf médian,0,255,0\n7,7th nerve,0,0,255\n",
    "fsl": "1 1.0 0 0 left lobe 2\n2 0.0 1.00000 0.0 Nerf médian\n7 0 0 1 7th nerve\n",
    "bytes first": "1 255 0 0 left lobe 2\n2 0 255 0 Nerf médian\n7 0 0 255 7th nerve\n",
    "workbench": "left lobe 2\n1 255 0 0 255\nNerf médian\n2 0 255 0 255\n7th nerve\n7 0 0 255 255\n",
    "plain": "1 left lobe 2\n2\tNerf médian\n7: 7th nerve\n",
    "quoted": "1 = 'left lobe 2'\r\n2;\"Nerf médian\"\r\n\r\n7, 7th nerve\r\n",
}
NAMES = {1: "left lobe 2", 2: "Nerf médian", 7: "7th nerve"}
COLORS = {1: (1, 0, 0), 2: (0, 1, 0), 7: (0, 0, 1)}
WITHOUT_COLORS = {"plain", "quoted"}


def written(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("form", FORMS)
def test_each_form_has_its_names_and_colours(tmp_path: Path, form: str) -> None:
    table = read_label_table(written(tmp_path / "t.txt", FORMS[form]))
    entries = {label: entry for label, entry in table.entries.items() if label}
    assert {label: entry.name for label, entry in entries.items()} == NAMES
    assert all(entry.shown for entry in entries.values())
    if form in WITHOUT_COLORS:
        assert all(entry.color is None for entry in entries.values())
    else:
        found = {label: tuple(srgb_from_linear(np.array(entry.color)).round(6)) for label, entry in entries.items()}
        assert found == COLORS


def test_colours_are_srgb(tmp_path: Path) -> None:
    (entry,) = read_label_table(written(tmp_path / "t.txt", "1 a 188 0 0 0\n")).entries.values()
    assert entry.color is not None and entry.color[0] == pytest.approx(((188 / 255 + 0.055) / 1.055) ** 2.4)


def test_a_label_that_the_table_hides_is_hidden(tmp_path: Path) -> None:
    text = '1 255 0 0 1 0 1 "no"\n2 0 255 0 1 1 1 "yes"\n3 0 0 255 0 1 1 "clear"\n'
    entries = read_label_table(written(tmp_path / "t.txt", text)).entries
    assert [entries[label].shown for label in (1, 2, 3)] == [False, True, False]


def test_numbers_behind_all_names_are_no_part_of_them(tmp_path: Path) -> None:
    table = read_label_table(written(tmp_path / "aal.txt", "1 Precentral_L 2001\n2 Precentral_R 2002\n"))
    assert [entry.name for entry in table.entries.values()] == ["Precentral_L", "Precentral_R"]
    table = read_label_table(written(tmp_path / "some.txt", "1 area 4\n2 thalamus\n"))
    assert [entry.name for entry in table.entries.values()] == ["area 4", "thalamus"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "it has no lines"),
        ("# nothing\n\n", "it has no lines"),
        ("1 liver\nspleen\n3 kidney\n", "line 2 is 'spleen'"),
        ("1 0 0 12\n0 1 0 3\n0 0 1 7\n", "line 1 is '1 0 0 12'"),  # a transform
        ("1 liver 255 0 0 0\n2 spleen 255 0\n", "line 2 is '2 spleen 255 0'"),
        ("1 a b\x07\n3\n", "line 2 is '3'"),
        ("99999999 liver\n", "line 1 is '99999999 liver'"),
        ("1 " + "x" * 2000, "line 1 has more than 1000 letters"),
    ],
)
def test_other_texts_are_refused_with_their_line(tmp_path: Path, text: str, fault: str) -> None:
    with pytest.raises(InputError) as error:
        read_label_table(written(tmp_path / "t.txt", text))
    assert str(error.value).startswith(f"{tmp_path}/t.txt: label names must be lines of one form")
    assert str(error.value).endswith(fault)


def test_what_can_not_be_read_is_said(tmp_path: Path) -> None:
    for path, reason in ((tmp_path / "none.txt", "cannot be read"), (tmp_path, "is a folder")):
        with pytest.raises(InputError, match=reason):
            read_label_table(path)
    (tmp_path / "b.lut").write_bytes(bytes(range(256)) * 3)
    with pytest.raises(InputError, match="is not UTF-8"):
        read_label_table(tmp_path / "b.lut")


@given(st.text(alphabet="01 9.,;:=\t\"'#ab\n-é", max_size=200))
def test_any_text_is_a_table_or_an_input_error(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "any.txt"
    path.write_text(text, encoding="utf-8")
    try:
        table = read_label_table(path)
    except InputError:
        return
    assert table.entries and all(any(map(str.isalpha, entry.name)) for entry in table.entries.values())


def segmentation(path: Path, labels: tuple[int, ...] = (1, 2, 7)) -> Path:
    """A NIfTI file with these labels and 0."""
    import nibabel

    values = np.zeros((6, 5, 8), np.int16)
    for number, label in enumerate(labels):
        values[number % 6, 1:4, 1 + number // 6] = label
    path.parent.mkdir(parents=True, exist_ok=True)
    nibabel.save(nibabel.Nifti1Image(values, np.eye(4)), path)
    return path


def named(path: Path, **how: object) -> dict[int, str]:
    return names_of(texvol.load(path, labels=True, **how), range(1, 8))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "name", ["seg.txt", "seg.nii.txt", "seg.nii.gz.txt", "seg.lut", "seg.ctbl", "seg.ctab", "seg.label"]
)
def test_a_table_of_the_same_name_is_found(tmp_path: Path, name: str) -> None:
    volume = segmentation(tmp_path / "seg.nii.gz")
    written(tmp_path / "other.txt", "1 a\n2 b\n7 c\n")
    written(tmp_path / name, FORMS["freesurfer"])
    assert named(volume) == NAMES


def test_the_only_table_of_the_folder_is_found_among_other_texts(tmp_path: Path) -> None:
    volume = segmentation(tmp_path / "seg.nii.gz")
    written(tmp_path / "readme.txt", "Made by hand.\n")
    written(tmp_path / "matrix.txt", "1 0 0 12\n0 1 0 3\n0 0 1 7\n0 0 0 1\n")
    (tmp_path / "folder.txt").mkdir()
    table = written(tmp_path / "names of labels.txt", FORMS["itk-snap"])
    assert named(volume) == NAMES
    found = table_of(texvol.load(volume, labels=True))
    assert found is not None and found.source == str(table) and found.found
    # Of two nobody knows which is meant.
    written(tmp_path / "more.lut", FORMS["fsl"])
    assert named(volume) == {}


def test_a_table_that_fits_no_labels_is_none_unless_it_is_asked_for(tmp_path: Path) -> None:
    volume = segmentation(tmp_path / "seg.nii.gz", (1, 2, 7, 8, 9))
    table = written(tmp_path / "chapters.txt", "1 Introduction\n2 Methods\n3 Results\n")
    assert named(volume) == {}, "two of five labels"
    assert named(volume, label_names=table) == {1: "Introduction", 2: "Methods", 3: "Results"}
    assert named(segmentation(tmp_path / "two.nii.gz", (1, 2)))[2] == "Methods"


def test_who_asks_for_names_has_labels_and_who_wants_none_has_none(tmp_path: Path) -> None:
    volume = segmentation(tmp_path / "seg.nii.gz")
    table = written(tmp_path / "seg.txt", FORMS["plain"])
    assert texvol.load(volume, label_names=table).labels
    assert not texvol.load(volume).labels
    assert named(volume) == NAMES and named(volume, label_names="none") == {}
    with pytest.raises(InputError, match="lost.txt: cannot be read"):
        texvol.load(volume, label_names=tmp_path / "lost.txt")


def test_a_folder_has_no_table(tmp_path: Path) -> None:
    written(tmp_path / "series" / "names.txt", FORMS["plain"])
    assert label_table_beside(tmp_path / "series") is None


COLUMNS = {
    "bids": "index\tname\tabbreviation\tcolor\tmapping\n"
    "1\tleft lobe 2\tLL\t#ff0000\t1\n2\tNerf médian\tNM\t#00FF00\tn/a\n"
    "7\t7th nerve\tn/a\t0000ff\t2\n9\tn/a\tn/a\tn/a\tn/a\n",
    "slicer": "LabelValue,Name,Color_R,Color_G,Color_B,Color_A,Region_CodeMeaning\n"
    '1,"left lobe 2",255,0,0,255,"Lobe, left"\n2,Nerf médian,0,255,0,255,\n7,7th nerve,0,0,255,255,\n',
    "names": "index\tlabel\tlabel_7network\n1.0\tleft lobe 2\tVis_1\n2.0\tNerf médian\tn/a\n7.0\t7th nerve\tn/a\n",
}


@pytest.mark.parametrize("form", COLUMNS)
def test_a_first_line_names_the_columns(tmp_path: Path, form: str) -> None:
    entries = read_label_table(written(tmp_path / "t.tsv", COLUMNS[form])).entries
    assert {label: entry.name for label, entry in entries.items()} == NAMES
    colors = {label: entry.color and tuple(srgb_from_linear(np.array(entry.color))) for label, entry in entries.items()}
    assert colors == (
        dict.fromkeys(NAMES) if form == "names" else {each: pytest.approx(COLORS[each]) for each in NAMES}
    )


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "index\tname\n1\ta\nx\tb\n",
            "line 3 must have a whole number as label and a name of at most 200 letters, got 'x'",
        ),
        ("index\tname\tcolor\n1\ta\tred\n", "line 2: color must be #RRGGBB, got 'red'"),
        (
            "LabelValue,Name,Color_R,Color_G,Color_B\n1,a,0,0,256\n",
            "line 2: colours must be whole numbers from 0 to 255",
        ),
        ("index\tname\n99999999\ta\n", "line 2: labels must be at most"),
        ("index\tname\n", "must have a line with a label and a name"),
    ],
)
def test_a_fault_below_named_columns_is_said_with_its_line(tmp_path: Path, text: str, fault: str) -> None:
    path = written(tmp_path / "t.tsv", text)
    with pytest.raises(InputError) as error:
        read_label_table(path)
    assert str(error.value).startswith(f"{path}: {fault}")


@given(
    st.sampled_from(["index\tname\tcolor", "LabelValue,Name,Color_R,Color_G,Color_B,Color_A", "label;name;r;g;b;a"]),
    st.text(alphabet='019.,;\t"#nab/-\n', max_size=100),
)
def test_any_text_below_named_columns_is_a_table_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, header: str, text: str
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.tsv"
    path.write_text(f"{header}\n{text}", encoding="utf-8")
    try:
        entries = read_label_table(path).entries
    except InputError as error:
        assert "\n" not in str(error)
        return
    assert entries and all(entry.name for entry in entries.values())


def test_an_alpha_of_0_hides_nothing_where_most_have_it(tmp_path: Path) -> None:
    """FreeSurfer's own table: 0 for nearly all labels, 255 for a few."""
    few = "0 Unknown 0 0 0 0\n1 a 9 0 0 0\n2 b 0 9 0 0\n3 c 0 0 9 255\n"
    assert all(entry.shown for entry in read_label_table(written(tmp_path / "f.txt", few)).entries.values())
    most = "0 background 0 0 0 0\n1 a 9 0 0 0\n2 b 0 9 0 255\n3 c 0 0 9 255\n"
    entries = read_label_table(written(tmp_path / "s.ctbl", most)).entries
    assert [entry.shown for entry in entries.values()] == [False, False, True, True]
