"""Films as GIF: their pictures, how long each is shown, and what is refused."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from texvol.__main__ import main
from texvol.formats.films import containers as film_formats
from texvol.formats.films import film
from texvol.formats.pictures import image

pytest.importorskip("imageio_ffmpeg", reason="films need the extra: pip install '.[film]'")
Image = pytest.importorskip("PIL.Image", reason="GIFs are read with the extra: pip install '.[annotation]'")


def run(*line: str) -> int:
    return main(["render", "v.npy", "--tf", "fog", "--size", "47x33", "--backend", "auto", *line])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with a volume that is no cube."""
    np.save(tmp_path / "v.npy", np.random.default_rng(0).random((12, 10, 8)).astype(np.float32))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def read_gif(name: str) -> tuple[list[int], np.ndarray, dict]:
    """Milliseconds of each picture, the pictures, (views, height, width, 3) integers, and what else it says."""
    with Image.open(name) as file:
        durations, pictures = [], []
        for number in range(file.n_frames):
            file.seek(number)
            durations.append(file.info["duration"])
            pictures.append(np.asarray(file.convert("RGB")).astype(int))
        return durations, np.stack(pictures), dict(file.info)


def test_pictures_of_a_gif_are_those_of_the_orbit_and_begin_again(folder: Path) -> None:
    assert run("--orbit", "5", "--fps", "30", "-o", "turn.gif") == 0
    assert run("--orbit", "5", "-o", "turn_%d.png") == 0
    durations, pictures, metadata = read_gif("turn.gif")
    assert pictures.shape == (5, 33, 47, 3)  # odd sides, which MP4 refuses
    assert metadata["loop"] == 0  # for ever
    # 30 a second, each begun at the hundredth of a second that is nearest to its time.
    # The last one lasts as long as the one before.
    assert durations == [30, 40, 30, 30, 30]
    for number, picture in enumerate(pictures):
        single = np.asarray(Image.open(f"turn_{number}.png").convert("RGB")).astype(int)
        # Fog has hardly more than 256 colours; what dither and the rest of them cost is about a step on the average.
        assert np.abs(picture - single).mean() < 2
        others = [np.abs(picture - other).mean() for other in pictures[:number]]
        assert all(other > 5 for other in others), "each is another view"


@pytest.mark.parametrize("fps, seconds", [("12.5", 1.6), ("50", 0.4), ("3", 6.67), ("24", 0.83)])
def test_a_gif_takes_as_long_as_its_frames_per_second_say(folder: Path, fps: str, seconds: float) -> None:
    assert run("--orbit", "20", "-o", "turn.gif", "--fps", fps) == 0
    durations, _, _ = read_gif("turn.gif")
    # Times are counted in hundredths of a second: the sum is off by one, and no picture by more.
    assert sum(durations) / 1000 == pytest.approx(seconds, abs=0.011)
    assert max(durations) - min(durations) <= 10 and min(durations) >= 20


def test_a_still_object_keeps_all_its_frames_in_time(folder: Path) -> None:
    """Pictures that are all the same are still shown for so long."""
    with film.Writer("still.gif", (16, 12), 6, fps=10) as writer:
        for _ in range(6):
            writer.add(np.full((12, 16, 4), 0.5, np.float32))
        writer.finish()
    durations, pictures, _ = read_gif("still.gif")
    assert sum(durations) == 600
    assert (np.abs(pictures - image.eight_bits(np.full((1, 1, 4), 0.5, np.float32))) <= 1).all()


@pytest.mark.parametrize(
    "line, message",
    [
        (["-o", "a.gif"], "a film needs several pictures: give --orbit N or --time all"),
        (["--orbit", "3", "-o", "a_%d.gif"], "the name of a film must not have"),
        (["--orbit", "3", "-o", "a.gif", "--fps", "60"], "a.gif: --fps must be at most 50 for a GIF, got 60"),
        (["--orbit", "3", "-o", "a_%d.png", "--fps", "25"], "whose name ends with .mp4 or .gif"),
    ],
)
def test_what_no_gif_can_be_is_refused_on_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], line: list[str], message: str
) -> None:
    assert run(*line) == 2
    error = capsys.readouterr().err
    assert error.startswith("texvol: error: ") and error.count("\n") == 1 and message in error
    assert os.listdir(".") == ["v.npy"]


def test_kinds_are_told_by_name_whatever_its_case() -> None:
    assert film_formats.is_film("A.GIF") and film_formats.is_gif("A.GIF") and film_formats.is_film("a.mp4")
    assert not film_formats.is_film("gif") and not film_formats.is_gif("a.mp4")
