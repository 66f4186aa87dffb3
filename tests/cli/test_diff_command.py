"""`texvol diff`: statuses, words and files, on pairs whose difference is known."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.compared_pictures import smooth
from support.picture_files import write

from texvol.__main__ import main
from texvol.formats.pictures import image
from texvol.util import color


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, which is the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def store(name: str, pixels: NDArray, **attributes: str) -> str:
    image.write(name, pixels, {key.replace("__", ":"): value for key, value in attributes.items()}, transparent=True)
    return name


def diff(capsys: pytest.CaptureFixture[str], *line: str) -> tuple[int, str]:
    """Exit status and what was printed; nothing goes to stderr, or one line of error."""
    status = main(["diff", *line])
    said = capsys.readouterr()
    if status == 2:
        assert said.err.startswith("texvol: error: ") and said.err.count("\n") == 1
        return status, said.err
    assert not said.err
    return status, said.out


def as_json(capsys: pytest.CaptureFixture[str], *line: str) -> tuple[int, dict[str, Any]]:
    status, text = diff(capsys, *line, "--json")
    return status, json.loads(text)


def shifted(picture: NDArray, dx: float) -> NDArray[np.float32]:
    """The picture moved to the right by a part of a pixel, exactly, since it is periodic."""
    frequencies = np.fft.fftfreq(picture.shape[1])[:, np.newaxis]
    moved = np.fft.ifft(np.fft.fft(picture, axis=1) * np.exp(-2j * np.pi * frequencies * dx), axis=1).real
    return moved.astype(np.float32)


def test_a_picture_is_the_same_as_itself(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a = store("a.exr", smooth())
    status, words = diff(capsys, a, a)
    assert status == 0 and words.startswith("same: ")
    status, metadata = as_json(capsys, a, a, "--max-abs", "0", "--rms", "0", "--flip", "0", "--hard-max", "0")
    assert status == 0 and metadata["measures"]["parts"]["all"]["max_error"] == 0 and metadata["kinds"] == []
    # JSON has no infinity.
    assert metadata["measures"]["parts"]["all"]["psnr"] is None


def test_a_shift_by_a_tenth_of_a_pixel_is_found_named_and_measured(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reference = smooth((160, 120), seed=8)
    status, metadata = as_json(capsys, store("a.exr", shifted(reference, 0.1)), store("b.exr", reference))
    assert status == 1 and metadata["status"] == "different"
    assert metadata["kinds"][0]["name"] == "shifted"
    assert metadata["kinds"][0]["parameters"]["dx"] == pytest.approx(0.1, abs=0.01)
    assert metadata["kinds"][0]["parameters"]["dy"] == pytest.approx(0, abs=0.01)


def test_one_pixel_off_by_a_half(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reference = smooth((160, 120))
    candidate = reference.copy()
    candidate[40, 99, 0] += 0.5
    a, b = store("a.exr", candidate), store("b.exr", reference)
    status, metadata = as_json(capsys, a, b)
    assert status == 1 and metadata["measures"]["worst_pixel"] == [99, 40]
    assert metadata["measures"]["parts"]["all"]["max_error"] == pytest.approx(0.5, abs=1e-6)
    assert metadata["kinds"][0]["name"] == "isolated pixels"
    assert diff(capsys, a, b, "--max-abs", "0.4", "--fail-percent", "1", "--hard-max", "0.6")[0] == 0
    assert diff(capsys, a, b, "--max-abs", "0.4", "--fail-percent", "1", "--hard-max", "0.4")[0] == 1
    assert diff(capsys, a, b, "--max-abs", "0.4")[0] == 1
    assert diff(capsys, a, b, "--max-abs", "0.51")[0] == 0


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_pixel_that_is_no_number_fails_whatever_the_limits(
    here: Path, capsys: pytest.CaptureFixture[str], wrong: float
) -> None:
    reference = smooth()
    candidate = reference.copy()
    candidate[11, 5, 2] = wrong
    a, b = store("a.exr", candidate), store("b.exr", reference)
    loose = ["--max-abs", "inf", "--fail-percent", "100", "--rms", "inf"]
    for pair in ((a, b), (b, a), (a, a)):
        status, metadata = as_json(capsys, *pair, *loose)
        assert status == 1 and metadata["status"] == "broken"
        assert metadata["measures"]["non_finite"] == 1
        assert "column 5, row 11" in " ".join(metadata["violations"])
    assert "not finite" in [kind["name"] for kind in as_json(capsys, a, b)[1]["kinds"]]


def test_eight_bits_of_a_picture_are_the_same_picture(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = smooth((200, 150))
    exact, rounded = store("a.exr", picture), store("a.png", picture)
    for pair in ((exact, rounded), (rounded, exact)):
        status, metadata = as_json(capsys, *pair)
        assert status == 0, metadata["violations"]
        assert [kind["name"] for kind in metadata["kinds"]] == ["banding"]
        assert 1e-4 < metadata["measures"]["parts"]["all"]["max_error"] < 0.01


def test_eight_bits_without_opacity_are_the_picture_over_its_background(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = smooth((200, 150))
    image.write("a.png", picture)
    store("a.exr", picture)
    for pair in (("a.png", "a.exr"), ("a.exr", "a.png")):
        status, metadata = as_json(capsys, *pair)
        assert status == 0 and not metadata["violations"]
        assert "a.png has no opacity" in metadata["notes"][0] and "taken as black" in metadata["notes"][0]
        assert metadata["measures"]["parts"]["all"]["max_error"] < 0.01


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_a_format_that_would_have_held_opacity_has_lost_it(
    here: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    picture = smooth((200, 150))
    store("a.exr", picture), store("a.png", picture)
    write(Path("b.exr"), picture[..., :3])
    image.write("b.png", picture)
    for pair in ((f"b.{kind}", "a.png"), ("a.png", f"b.{kind}")):
        status, metadata = as_json(capsys, *pair)
        assert status == 1 and metadata["status"] == "broken" and "channels" in metadata["violations"][0]


@pytest.mark.parametrize("direction", ["candidate", "reference"])
def test_srgb_against_linear_is_named(here: Path, capsys: pytest.CaptureFixture[str], direction: str) -> None:
    linear = smooth((200, 150))
    encoded = linear.copy()
    encoded[..., :3] = color.srgb_from_linear(linear[..., :3])
    pair = (encoded, linear) if direction == "candidate" else (linear, encoded)
    status, metadata = as_json(capsys, store("a.exr", pair[0]), store("b.exr", pair[1]))
    assert status == 1 and metadata["kinds"][0]["name"] == "gamma"
    assert "sRGB" in metadata["kinds"][0]["words"]


def test_another_size_is_no_crash(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = store("a.exr", smooth((30, 20))), store("b.exr", smooth((20, 30)))
    status, words = diff(capsys, a, b, "--html", "a.html")
    assert status == 1 and "30 × 20" in words and "20 × 30" in words
    assert Path("a.html").exists()
    status, metadata = as_json(capsys, a, b, "--output", "d.png")
    assert status == 1 and "sizes" in metadata["notes"][-1] and not Path("d.png").exists()


def test_pictures_of_two_drivers_have_looser_limits(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reference = smooth((200, 150))
    candidate = reference + np.float32(0.0005)
    one, other = {"texvol__renderer": "one"}, {"texvol__renderer": "other"}
    assert diff(capsys, store("a.exr", candidate, **one), store("b.exr", reference, **one))[0] == 1
    status, metadata = as_json(capsys, "a.exr", store("b.exr", reference, **other))
    assert status == 0 and metadata["limits"]["source"] == "two drivers"
    assert any("one" in note and "other" in note for note in metadata["notes"])
    assert diff(capsys, "a.exr", "b.exr", "--limits", "one-driver")[0] == 1


def test_pictures_of_numbers_are_measured_by_their_range(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    numbers = smooth((60, 50)) * np.array([1000, 1000, 1000, 1], np.float32)
    metadata = {"texvol__scene": json.dumps({"mode": "mip"})}
    store("a.exr", numbers + np.array([0.1, 0.1, 0.1, 0], np.float32), **metadata)
    status, found = as_json(capsys, "a.exr", store("b.exr", numbers, **metadata))
    assert status == 0
    assert found["measures"]["parts"]["all"]["max_error"] == pytest.approx(0.1 / np.ptp(numbers[..., :3]), rel=1e-3)
    store("a.exr", numbers + np.array([9, 9, 9, 0], np.float32), **metadata)
    assert diff(capsys, "a.exr", "b.exr")[0] == 1


def test_the_difference_is_written_as_a_picture(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = smooth(seed=1), smooth(seed=2)
    diff(capsys, store("a.exr", a), store("b.exr", b), "--output", "d.exr", "--gain", "3")
    np.testing.assert_allclose(image.read("d.exr"), 3 * np.abs(a - b), atol=1e-6)
    diff(capsys, "a.exr", "b.exr", "--output", "d.png")
    assert image.read("d.png").shape == (48, 64, 3)


def test_a_detailed_status_tells_new_and_broken_apart(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = store("a.exr", smooth(seed=1)), store("b.exr", smooth(seed=2))
    detailed = "--detailed-exitcode"
    assert diff(capsys, a, a, detailed)[0] == 0
    assert diff(capsys, a, b, detailed)[0] == 1
    status, words = diff(capsys, a, "gone.exr", detailed)
    assert status == 3 and words.startswith("new: ")
    assert as_json(capsys, a, "gone.exr", detailed) == (3, {"name": a, "status": "new"})
    assert diff(capsys, a, store("c.exr", smooth((9, 9))), detailed)[0] == 6
    assert diff(capsys, "gone.exr", a, detailed)[0] == 2
    assert diff(capsys, a, "gone.exr")[0] == 2


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (["a.exr"], "two pictures"),
        ([], "two pictures"),
        (["a.exr", "gone.exr"], "gone.exr: cannot be read"),
        (["a.exr", "."], "got a folder"),
        (["a.exr", "a.exr", "--max-abs", "-1"], "--max-abs"),
        (["a.exr", "a.exr", "--rms", "nan"], "--rms"),
        (["a.exr", "a.exr", "--fail-percent", "200"], "at most 100"),
        (["a.exr", "a.exr", "--limits", "gone.toml"], "gone.toml"),
        (["a.exr", "a.exr", "--limits", "none-such"], "one-driver, two-drivers"),
        (["a.exr", "a.exr", "--html", "no/such/place.html"], "no/such"),
        (["a.exr", "a.exr", "--output", "d.gif"], ".exr, .png"),
        (["a.exr", "a.exr", "--oracle"], "needs a scene"),
        (["a.exr", "a.exr", "--self-test", "a.exr"], "takes no CANDIDATE and REFERENCE"),
        (["--self-test", "a.exr"], "a.exr"),
        (["--self-test", "gone.exr"], "gone.exr"),
        (["a.exr", "a.exr", "--html", "a.exr"], "must not overwrite an input"),
        (["a.exr", "a.exr", "--output", "./a.exr"], "must not overwrite an input"),
        (["--self-test", "a.exr", "--html", "a.exr"], "must not overwrite an input"),
        (["a.exr", "a.exr", "--html", "x.png", "--output", "x.png"], "two files"),
        (["a.exr", "a.exr", "--html", "/dev/null"], "regular file"),
        (["a.exr", "/dev/zero"], "pipe or device"),
        (["\udcff.exr", "a.exr"], "UTF-8"),
    ],
)
def test_wrong_usage_is_one_line_and_leaves_no_file(
    here: Path, capsys: pytest.CaptureFixture[str], line: list[str], words: str
) -> None:
    store("a.exr", smooth())
    status, said = diff(capsys, *line)
    assert status == 2 and words in said
    assert os.listdir(here) == ["a.exr"]


def test_a_pipe_is_refused_and_not_waited_for(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo("pipe.exr")
    status, said = diff(capsys, "pipe.exr", "pipe.exr")
    assert status == 2 and "pipe or device" in said


def test_a_hostile_header_is_no_crash(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a = store("a.exr", smooth(seed=1), texvol__scene="[" * 100_000)
    status, metadata = as_json(capsys, a, store("b.exr", smooth(seed=2)))
    assert status == 1 and any("nested deeper" in note for note in metadata["notes"])


def test_numbers_of_pictures_without_opacity_are_those_of_their_colours(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    random = np.random.default_rng(0)
    a, b = random.random((2, 30, 40, 3), np.float32)
    for name, pixels in (("a.exr", a), ("b.exr", b)):
        write(Path(name), pixels)
    parts = as_json(capsys, "a.exr", "b.exr")[1]["measures"]["parts"]
    assert set(parts) == {"all", "color"}
    assert parts["all"]["rms_error"] == pytest.approx(np.sqrt(np.square(a - b).mean()), rel=1e-6)
    assert parts["all"]["mean_error"] == pytest.approx(np.abs(a - b).mean(), rel=1e-6)
