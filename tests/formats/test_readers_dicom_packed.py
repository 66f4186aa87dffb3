"""DICOM's compressed frames: read as they were written, and never the end of the process where they are damaged."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pydicom import uid
from pydicom.encaps import encapsulate
from support.dicom_files import slice_of
from support.processes import open_files
from support.refusal import refused, told_well

from texvol import InputError, load
from texvol.formats.readers import dicom_pixels

imagecodecs = pytest.importorskip("imagecodecs")
pytest.importorskip("gdcm")

GRAY = (np.add.outer(np.arange(48) ** 2, np.arange(64) * 7) % 4096).astype(np.uint16)
BYTES = (GRAY // 16).astype(np.uint8)
STREAMS: dict[str, tuple[str, Callable[[NDArray], bytes], NDArray, float]] = {
    "JPEG": (uid.JPEGBaseline8Bit, lambda a: imagecodecs.jpeg8_encode(a, level=98), BYTES, 40),
    "lossless JPEG": (uid.JPEGLosslessSV1, lambda a: imagecodecs.ljpeg_encode(a, bitspersample=12), GRAY, 0),
    "JPEG-LS": (uid.JPEGLSLossless, imagecodecs.jpegls_encode, GRAY, 0),
    "JPEG 2000": (
        uid.JPEG2000Lossless,
        lambda a: imagecodecs.jpeg2k_encode(a, reversible=True, codecformat="j2k"),
        GRAY,
        0,
    ),
}


def written(path: Path, kind: str, streams: list[bytes], **fields: object) -> Path:
    """A file of compressed frames."""
    syntax, _, pixels, _ = STREAMS[kind]
    dataset = slice_of(0, pixels, SpacingBetweenSlices=1, **fields)
    if len(streams) > 1:
        dataset.NumberOfFrames = len(streams)
    dataset.file_meta.TransferSyntaxUID = syntax
    dataset.PixelData = encapsulate(streams)
    dataset["PixelData"].VR, dataset["PixelData"].is_undefined_length = "OB", True
    dataset.save_as(path, enforce_file_format=True)
    return path


@pytest.mark.parametrize("kind", STREAMS)
def test_frames_are_read_as_they_were_written(tmp_path: Path, kind: str) -> None:
    _, encode, pixels, most = STREAMS[kind]
    frames = [pixels, pixels[::-1].copy(), pixels.T.repeat(2, 0)[:48, :1].repeat(64, 1)]
    found = load(written(tmp_path / "v.dcm", kind, [encode(each) for each in frames])).values
    assert found.dtype == pixels.dtype
    assert np.abs(found.astype(float) - np.stack(frames)).max() <= most


@pytest.mark.parametrize("kind", STREAMS)
def test_damaged_frames_are_refused_or_read_and_end_nothing(
    tmp_path: Path, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """Bits, bytes and lengths; of lossless JPEG and JPEG-LS ended the process before."""
    random = np.random.default_rng(5)
    stream = STREAMS[kind][1](STREAMS[kind][2])
    refusals, before = 0, open_files()
    for number in range(12):
        damaged = bytearray(stream[: int(random.integers(1, len(stream)))] if number % 4 == 0 else stream)
        for at in random.integers(0, min(len(damaged), 700 if number % 2 else 60), 1 + number % 9):
            damaged[at] = random.integers(256)
        path = written(tmp_path / "v.dcm", kind, [bytes(damaged)])
        try:
            assert load(path).dimensions == (64, 48, 1)
        except InputError as error:
            told_well(error, path, capfd)
            refusals += 1
    assert refusals > 6
    assert open_files() - before == set()


@pytest.mark.parametrize("kind", STREAMS)
def test_half_a_frame_is_refused_and_not_made_grey(
    tmp_path: Path, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    before = open_files()
    _, encode, pixels, _ = STREAMS[kind]
    stream = encode(pixels)
    path = written(tmp_path / "v.dcm", kind, [stream, stream[: len(stream) // 2] + b"\xff\xd9", stream])
    assert "pixels can't be read" in refused(path, capfd)
    assert open_files() - before == set()


def test_a_decoder_that_breaks_off_is_an_error_with_its_signal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(dicom_pixels, "_frames", lambda one: os.abort())
    path = written(tmp_path / "v.dcm", "JPEG", [STREAMS["JPEG"][1](BYTES)])
    assert "crashed (signal SIGABRT)" in refused(path, capfd)


def test_a_decoder_that_does_not_end_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(dicom_pixels, "_frames", lambda one: time.sleep(1000))
    monkeypatch.setattr(dicom_pixels, "_PATIENCE", 0.2)
    path = written(tmp_path / "v.dcm", "JPEG", [STREAMS["JPEG"][1](BYTES)])
    start = time.perf_counter()
    assert "does not end" in refused(path, capfd)
    assert time.perf_counter() - start < 5


def test_a_header_that_asks_for_more_than_its_frames_hold(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "v.dcm", "JPEG-LS", [STREAMS["JPEG-LS"][1](GRAY)], Rows=30000, Columns=30000)
    assert "more than 10000 times" in refused(path, capfd)


def test_of_many_frames_no_more_is_made_than_is_read(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    dataset = slice_of(0, np.zeros((1, 1), np.uint8), SpacingBetweenSlices=1)
    dataset.NumberOfFrames, dataset.PixelData = 200_000, bytes(200_000)
    dataset.save_as(tmp_path / "v.dcm", enforce_file_format=True)
    start = time.process_time()
    assert "must be at most 65536, got 200000" in refused(tmp_path / "v.dcm", capfd)
    assert time.process_time() - start < 1
    dataset.NumberOfFrames, dataset.PixelData = 20_000, bytes(20_000)
    dataset.save_as(tmp_path / "w.dcm", enforce_file_format=True)
    start = time.process_time()
    assert load(tmp_path / "w.dcm").dimensions == (1, 1, 20_000)
    assert time.process_time() - start < 5  # 1 s on one core at 3 GHz
