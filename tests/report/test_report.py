"""`texvol report`: what it writes, that it writes all or nothing, and how its page looks in a browser."""

from __future__ import annotations

import csv
import json
import re
import signal
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.browser import Browser, Page
from support.scenes import BONE, smooth_volume

from texvol.__main__ import main
from texvol.comparison import Difference
from texvol.formats.pictures import image
from texvol.report import check_folder, measuring, plot, words
from texvol.report.convergence import Asked, ErrorOf, Limits, Measurement, Setting, discretisation_max, total_max
from texvol.report.error_pictures import decades, false_color
from texvol.util.installation import install_command

FILES = {"report.html", "report.csv", "report.md", "pareto-max.png", "pareto-rms.png"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a volume and a quick report on it, `out`: one frame of each setting, and fewer rates.

    Each plot is drawn in one theme, each theme once: they take most of the time.
    """
    position = tmp_path_factory.mktemp("report")
    np.save(position / "<wavy & sharp>.npy", smooth_volume(20).values)
    (position / "tf.json").write_text(json.dumps(BONE.as_json()))
    scene = ["--tf", str(position / "tf.json"), "--size", "64x48", "--background", "0.1,0.2,0.3"]
    line = ["report", str(position / "<wavy & sharp>.npy"), "-o", str(position / "out"), *scene, "--quick"]
    drawn, themes = plot.pareto_plot, {"max": "light", "rms": "dark"}
    with (
        patch.object(measuring, "_limits", lambda quick: Limits(least_frames=1, frames_seconds=0)),
        patch.object(measuring, "QUICK_RATES", (0.5, 1.0)),
        patch.object(plot, "pareto_plot", lambda findings, metric, _: drawn(findings, metric, themes[metric])),
    ):
        assert main(line) == 0
    return position


@pytest.fixture(scope="module")
def page(folder: Path) -> str:
    return (folder / "out" / "report.html").read_text("utf-8")


@pytest.fixture(scope="module")
def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "out" / "report.csv").open(newline="") as lines:
        return list(csv.DictReader(lines))


def test_all_files_are_there_and_nothing_else(folder: Path) -> None:
    assert {each.name for each in (folder / "out").iterdir()} == FILES


def test_the_table_holds_times_and_all_three_errors(rows: list[dict[str, str]]) -> None:
    ours = [row for row in rows if row["renderer"] == "texvol"]
    assert {row["classification"] for row in ours} == {"slab", "extinction", "post", "integrated"}
    assert {row["slicing"] for row in ours} == {"stacks", "polygons", "wilson"}
    assert {row["target_format"] for row in ours} == {"rgba8", "rgba16f", "rgba32f"}
    assert {row["texture_format"] for row in ours} >= {"rgba8", "rgba16f", "rgba32f"}
    for row in ours:
        assert not row["skipped"]
        assert float(row["seconds"]) > 0 and float(row["bake_seconds"]) >= 0 and float(row["upload_seconds"]) > 0
        assert 0 < float(row["discretisation_rms_error"]) <= float(row["discretisation_max_error"])
        assert 0 < float(row["total_rms_error"]) <= float(row["total_max_error"])
        assert float(row["estimated_error"]) >= 0
        if row["classification"] in ("post", "integrated"):
            assert row["total_max_error"] == row["discretisation_max_error"]
            assert row["model_max_error"] == ""
        else:
            assert float(row["model_max_error"]) > 0
    assert any(row["on_max_front"] == "1" for row in rows)


def test_vtk_is_measured_beside_us_or_the_page_says_why_not(rows: list[dict[str, str]], page: str) -> None:
    for mapper in ("VTK GPU", "VTK fixed-point"):
        assert any(row["renderer"] == mapper for row in rows) or f"{mapper} was not measured" in page


def test_the_plots_show_something(folder: Path) -> None:
    for name in ("pareto-max.png", "pareto-rms.png"):
        picture = image.read(folder / "out" / name)
        assert picture.shape[1] > 1000
        assert len(np.unique(picture[::4, ::4, :3].mean(axis=2))) > 100


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.tags: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in ("meta", "link", "img", "source", "br"):
            self.open.append(tag)
        for name, value in attributes:
            if name in ("src", "srcset", "href"):
                self.addresses.append(value or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_asks_nothing_of_any_network(page: str) -> None:
    parsed = _Page()
    parsed.feed(page)
    assert not parsed.open, "every element is closed"
    assert parsed.addresses and all(each.startswith("data:") for each in parsed.addresses)
    assert "script" not in parsed.tags
    assert "url(" not in page and "@import" not in page


def test_the_page_says_what_a_reader_wants_to_know(page: str) -> None:
    assert "&lt;wavy &amp; sharp&gt;.npy" in page and "<wavy" not in page
    assert "20 × 20 × 20 samples of float32" in page
    for text in ("GL_RENDERER", "GL_VERSION", "cores", "numpy", "texvol report", "median", "model error"):
        assert text in page
    assert re.search(r'class="answer">(To keep|No setting keeps) ', page)
    assert "$" not in page, "a place of the template was left empty"


def measured(seconds: float, error: float, rate: float) -> Measurement:
    difference = Difference(error, error / 10, error / 20, (0, 0), 0)
    return Measurement(Setting("post", rate), 1.0, seconds=seconds, total=difference)


@pytest.mark.parametrize(
    ("errors", "said"),
    [
        ([0.02], "No setting keeps it within 0.01, 0.003 or 0.001; the most accurate is post at rate 1 with 2.0e-2."),
        ([], "No setting keeps it within 0.01, 0.003 or 0.001."),
        ([0.0005], "To keep it within 0.01, 0.003 and 0.001 use post at rate 1 (1 s a frame)."),
        (
            [0.008, 0.002],
            "To keep it within 0.01 use post at rate 1 (1 s a frame); within 0.003 use post at rate 2 (2 s a frame); "
            "none keeps it within 0.001.",
        ),
    ],
)
def test_the_answer_is_a_sentence(errors: list[float], said: str) -> None:
    measurements = [measured(number, error, number) for number, error in enumerate(errors, 1)]
    assert words.sentence(measurements, total_max, "it") == said


def asked(wanted: float, true_error: float | None, classification: str = "post") -> Asked:
    return Asked(classification, wanted, 2.0, 0.5, wanted, true_error)


def test_what_max_error_keeps_is_kept() -> None:
    said = words.sentence([measured(1, 0.008, 1)], total_max, "it", [asked(0.003, 0.0028), asked(0.001, 0.0012)])
    assert said == (
        "To keep it within 0.01 use post at rate 1 (1 s a frame); within 0.003 use post with --max-error 0.003 "
        "(2 s with the search); none keeps it within 0.001."
    )


ERRORS = st.sampled_from(
    [*(limit * nudge for limit in words.LIMITS for nudge in (0.5, 0.99, 1, 1.004, 1.2))]
) | st.floats(1e-5, 0.1)
MEASURED = st.builds(
    lambda classification, rate, own, more, seconds: Measurement(
        Setting(classification, rate),
        1.0,
        seconds=seconds,
        discretisation=Difference(own, own / 10, own / 20, (0, 0), 0),
        total=Difference(
            *((own, own / 10, own / 20) if classification == "post" else (more, more / 9, more / 20)), (0, 0), 0
        ),
    ),
    st.sampled_from(["slab", "post"]),
    st.sampled_from([0.5, 1.0, 2.0]),
    ERRORS,
    ERRORS,
    st.floats(1e-3, 1),
)
ASKED = st.builds(asked, st.sampled_from(words.LIMITS), st.none() | ERRORS, st.sampled_from(["slab", "post"]))


def kept_by(limit: float, measurements: list[Measurement], answers: list[Asked], error_of: ErrorOf) -> set[str]:
    """Settings that a table shows within a limit, by the digits that it shows."""
    shown = {each.setting.words for each in measurements if float(words.error(error_of(each))) <= limit}
    if error_of is discretisation_max:
        rows = [each for each in answers if each.true_error is not None]
    else:
        rows = [each for each in answers if each.true_error is not None and each.classification == "post"]
    return shown | {
        f"{each.classification} with --max-error {each.wanted:g}"
        for each in rows
        if float(words.error(each.true_error)) <= limit
    }


@given(st.lists(MEASURED, max_size=5), st.lists(ASKED, max_size=5))
@settings(max_examples=200, deadline=None)
def test_every_sentence_agrees_with_the_tables(measurements: list[Measurement], answers: list[Asked]) -> None:
    said = words.sentence(measurements, total_max, "it", answers)
    own = words.of_discretisation(measurements, total_max, answers)
    missed = re.search(r"(?:none keeps it|No setting keeps it) within ([^.;]*(?:\.\d+[^.;]*)*)", said)
    for limit in words.LIMITS:
        total = kept_by(limit, measurements, answers, total_max)
        is_missed = missed is not None and f"{limit:g}" in re.split(", | or ", missed[1])
        assert is_missed == (not total), said
        if total:
            use = next(
                each for each in re.split("; |To keep it ", said) if re.search(rf"within .*{limit:g}\b.* use ", each)
            )
            assert re.search(r" use (.*?) \(", use)[1] in total, (use, total)  # type: ignore[index]
        alone = kept_by(limit, measurements, answers, discretisation_max)
        named = f"{limit:g}" in re.findall(r"0\.\d+(?= (?:and|by)|, )", own)
        assert named == (bool(alone) and not total), own
        for error_of in (total_max, discretisation_max):
            cell = words.recommendation(measurements, error_of, limit, answers)
            found = kept_by(limit, measurements, answers, error_of)
            assert cell.startswith(("none; ", "not measured")) == (not found), cell
            assert not found or any(cell.startswith(each) for each in found), cell
            if nearest := re.search(r"the most accurate is .* with ([^,]*)", cell):
                assert float(nearest[1]) > limit


@given(ERRORS)
def test_a_shown_error_is_within_the_limits_that_it_keeps(number: float) -> None:
    for limit in words.LIMITS:
        assert (float(words.error(number)) <= limit) == (number <= limit)


def test_numbers_are_short() -> None:
    assert [words.seconds(each) for each in (None, 0.00123, 0.0999, 0.0345678, 0.5, 0.99999, 12.345)] == [
        "–", "1.23 ms", "99.9 ms", "34.6 ms", "500 ms", "1 s", "12.3 s",
    ]  # fmt: skip
    assert [words.error(each) for each in (None, 0.00123, 0.0, 3.0)] == ["–", "1.2e-3", "0.0e+0", "3.0e+0"]


def test_false_colours_get_brighter_with_the_error(tmp_path: Path) -> None:
    assert decades(0.0123) == (-5, -1)
    assert decades(0.0) == (-5, 0)
    assert decades(float("inf")) == (-5, 0)
    errors = np.array([[0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, np.nan]])
    (tmp_path / "map.png").write_bytes(false_color(errors, (-5, -1)))
    brightness = image.read(tmp_path / "map.png")[0, :, :3].sum(axis=1)
    assert brightness[0] == brightness[1] == brightness[2]
    assert (np.diff(brightness[2:7]) > 0).all()
    assert brightness[7] == brightness[6], "what is not finite counts as the worst"


def refused(capsys: pytest.CaptureFixture[str], *line: Any) -> str:
    assert main(["report", *map(str, line)]) == 2
    return capsys.readouterr().err


def test_a_bad_place_is_refused_before_the_work(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "needs a folder, got a file" in refused(capsys, "no.npy", "-o", folder / "tf.json")
    assert "does not exist" in refused(capsys, "no.npy", "-o", folder / "no" / "such")
    assert not (folder / "no").exists()
    check_folder(folder / "new")
    assert not (folder / "new").exists()


def test_a_missing_library_is_named(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert install_command("report") in refused(capsys, "no.npy", "-o", folder / "new")


def test_interrupted_it_leaves_nothing(folder: Path) -> None:
    line = [sys.executable, "-m", "texvol", "report", str(folder / "<wavy & sharp>.npy"), "-o", str(folder / "stopped")]
    process = subprocess.Popen([*line, "--size", "24x18"], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    for text in process.stderr:
        if "1/" in text:
            break
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    rest = process.stderr.read()
    assert process.wait(30) == 130
    assert "interrupted" in rest and "Traceback" not in rest
    assert not (folder / "stopped").exists()
    assert {each.name for each in folder.iterdir()} <= {"<wavy & sharp>.npy", "tf.json", "out"}


@pytest.mark.parametrize("width, dark", [(1280, True), (400, False)])
def test_the_page_in_a_browser(browser: Browser, folder: Path, tmp_path: Path, width: int, dark: bool) -> None:
    page = Page(browser, folder / "out" / "report.html", width, dark=dark)
    assert page.tell("document.images.length") >= 8
    assert page.tell("[...document.images].every(e => e.complete && e.naturalWidth > 0)")
    assert page.tell("document.documentElement.scrollWidth") <= width, "the page itself is not wider than the window"
    page.screenshot(tmp_path / "page.png")
    assert page.complaints() == [] and page.requests() == []
    page.close()
    screenshot = image.read(tmp_path / "page.png")[..., :3]
    paper = screenshot[2, 2].mean()
    assert paper < 0.2 if dark else paper > 0.8
    assert (np.abs(screenshot - screenshot[2, 2]).max(axis=2) > 0.1).mean() > 0.05, "not blank"
