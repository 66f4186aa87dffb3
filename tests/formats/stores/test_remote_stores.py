"""Stores on servers of the loopback: read as those on disk, and given up in bounded time when the server stops."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import boto3
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from support.raised import raised
from support.stores import field, served, write_ome

from texvol import InputError, Volume, load
from texvol.__main__ import main
from texvol.formats.stores import access
from texvol.formats.stores.access import ServerFault
from texvol.formats.stores.tensor_source import TensorSource
from texvol.formats.stores.writing.convert import Layout, convert
from texvol.scene.large_volume import LargeVolume

# Three attempts more, 2 s apart at most, and the time of a slow machine.
PATIENCE = 20.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("served")
    for version in ("0.4", "0.5"):
        write_ome(folder / f"v{version}.ome.zarr", field(), version=version, levels=2)
    return folder


@pytest.fixture(scope="module")
def bucket(folder: Path) -> Iterator[str]:
    """URL of a bucket with the same stores."""
    try:
        from moto.server import ThreadedMotoServer

        server = ThreadedMotoServer(port=0, verbose=False)
        server.start()
    except (ImportError, OSError) as error:
        pytest.skip(f"moto's server does not start: {error}")
    host, port = server.get_host_and_port()
    known = {"AWS_ENDPOINT_URL": f"http://{host}:{port}", "AWS_REGION": "us-east-1"}
    known |= {"AWS_ACCESS_KEY_ID": "someone", "AWS_SECRET_ACCESS_KEY": "secret"}
    before = {name: os.environ.get(name) for name in known}
    os.environ.update(known)
    try:
        client = boto3.client("s3", endpoint_url=known["AWS_ENDPOINT_URL"], region_name="us-east-1")
        client.create_bucket(Bucket="volumes")
        for path in folder.rglob("*"):
            if path.is_file():
                client.upload_file(str(path), "volumes", str(path.relative_to(folder)))
        yield "s3://volumes"
    finally:
        server.stop()
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_a_store_is_read_over_http(folder: Path, version: str, capfd: pytest.CaptureFixture[str]) -> None:
    with served(folder) as (url, _):
        volume = load(f"{url}/v{version}.ome.zarr")
        assert_array_equal(volume.values, field())
        assert volume.name == volume.source["absolute"] == f"{url}/v{version}.ome.zarr"
        assert volume.levels[0].source.bytes_read > 0  # type: ignore[attr-defined]
    assert capfd.readouterr().err == ""


def test_a_distant_store_is_asked_for_little(tmp_path: Path) -> None:
    """Metadata come in one file, statistics of the finest level with it, and no chunk of what is not looked at."""
    values = field(96)
    convert(Volume(values), tmp_path / "made.ome.zarr", layout=Layout((16, 16, 16), (64, 64, 64)))
    with served(tmp_path) as (url, server):
        asked: list[str] = server.asked  # type: ignore[attr-defined]
        volume = load(f"{url}/made.ome.zarr")
        assert volume.value_range == (values.min(), values.max())
        metadata = [each for each in asked if not each.endswith("/c/0/0/0")]
        names = sorted(each.rpartition("/made.ome.zarr/")[2] for each in metadata)
        assert names == ["labels/zarr.json", "zarr.json"]
        assert {each.rpartition("/made.ome.zarr/")[2].split("/")[1] for each in set(asked) - set(metadata)} == {"0"}
        asked.clear()
        assert volume.levels[1].statistics.variance.shape == (3, 3, 4)  # type: ignore[attr-defined, union-attr]
        assert not any(each.endswith("zarr.json") for each in asked)


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_a_store_is_read_from_s3(bucket: str, version: str, capfd: pytest.CaptureFixture[str]) -> None:
    volume = load(f"{bucket}/v{version}.ome.zarr")
    assert_array_equal(volume.values, field())
    assert volume.source["path"] == f"s3://volumes/v{version}.ome.zarr"
    message = str(raised(InputError, load, f"{bucket}/nothing.zarr"))
    assert message.startswith("s3://volumes/nothing.zarr: is no Zarr store")
    assert capfd.readouterr().err == ""


def test_what_is_secret_in_a_url_is_not_told(folder: Path) -> None:
    with served(folder) as (url, server):
        secret = url.replace("http://", "http://me:word@") + "/v0.5.ome.zarr?signature=abc"
        volume = load(secret)
        told = repr((volume.name, volume.source))
        assert "word" not in told
        assert "abc" not in told
        assert_array_equal(volume.part(0, (0, 0, 0), (3, 3, 3)).values, field()[:3, :3, :3])
        server.broken = True  # type: ignore[attr-defined]
        message = str(raised(InputError, volume.part, 0, (16, 16, 8), (18, 18, 9)))
        assert "word" not in message
        assert "abc" not in message


def test_a_server_that_stops_in_the_middle_is_an_error_in_bounded_time(folder: Path) -> None:
    with served(folder) as (url, server):
        volume = load(f"{url}/v0.5.ome.zarr")
        server.broken = True  # type: ignore[attr-defined]
        start = time.monotonic()
        message = str(raised(InputError, lambda: volume.values))
        assert time.monotonic() - start < PATIENCE
        assert message.startswith(f"{url}/v0.5.ome.zarr: level 0: ")
        assert "\n" not in message
        assert len(message) < 450


def test_a_server_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # nobody listens
        url = f"http://127.0.0.1:{taken.getsockname()[1]}/v.ome.zarr"
        start = time.monotonic()
        assert main(["info", url]) == 2
        assert time.monotonic() - start < PATIENCE
    (told,) = capsys.readouterr().err.splitlines()
    assert told.startswith(f"texvol: error: {url}: ")
    assert "connect" in told


def test_a_server_that_never_answers_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(access, "_PATIENCE", 2.0)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        url = f"http://127.0.0.1:{silent.getsockname()[1]}/v.ome.zarr"
        start = time.monotonic()
        message = str(raised(InputError, load, url))
        assert 2 < time.monotonic() - start < PATIENCE
    assert "its server has sent nothing for 2 s" in message


class Slow:
    """Future whose samples come late although all bytes have been read: they are still being decoded."""

    def __init__(self, times: int) -> None:
        self.left = times

    def result(self, timeout: float) -> np.ndarray:
        self.left -= 1
        if self.left >= 0:
            raise TimeoutError
        return np.zeros(3, np.uint8)


def test_files_that_take_long_to_decode_are_waited_for(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(access, "_PATIENCE", -1.0)
    volume = load(folder / "v0.5.ome.zarr")
    assert isinstance(volume, LargeVolume)
    source = volume.levels[0].source
    assert isinstance(source, TensorSource)
    assert_array_equal(source._received(Slow(3)), np.zeros(3))
    with served(folder) as (url, _):
        distant = access.Store(f"{url}/v0.5.ome.zarr")
        with pytest.raises(ServerFault, match="has sent nothing"):
            access.waited(Slow(3), check_alive=distant.check_alive)


def test_a_page_that_is_not_found_is_no_store(folder: Path) -> None:
    with served(folder) as (url, _):
        message = str(raised(InputError, load, f"{url}/none.zarr"))
    assert "is no Zarr store" in message


def test_a_url_may_stand_in_a_scene_file_and_a_header(folder: Path, tmp_path: Path) -> None:
    from texvol.options.scene_options import SceneOptions

    with served(folder) as (url, _):
        (tmp_path / "scene.toml").write_text(f'volume = "{url}/v0.5.ome.zarr"\nlevel = 1\nmemory = "1GB"\n')
        volume = SceneOptions.of(scene=str(tmp_path / "scene.toml")).load()
    assert volume.source == {"path": f"{url}/v0.5.ome.zarr", "absolute": f"{url}/v0.5.ome.zarr", "level": 1}
    assert volume.memory == 10**9  # type: ignore[attr-defined]
    assert np.prod(volume.shape) == field().size // 8
