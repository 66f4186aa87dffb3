"""Pictures by several processes are those of one, whatever becomes of a worker."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.quick_stats import quick_stats
from support.stores import write_ome

import texvol
from texvol import AddedVolume, ClipPlane, InputError, Light, Lighting, Renderer, Scene, TransferFunction, Volume
from texvol.__main__ import main
from texvol.distributed.renderer import DistributedRenderer
from texvol.distributed.sending import Packer, Unpacker
from texvol.distributed.workers import Workers

FOG = TransferFunction([0.3, 0.6, 1.0], [(1, 0, 0), (1, 0.5, 0), (1, 1, 1)], [0.0, 0.1, 0.3])
SIZE = (40, 32)


def ball(side: int = 32) -> np.ndarray:
    z, y, x = np.mgrid[:side, :side, :side] / (side - 1) - 0.5
    noise = np.random.default_rng(0).random((side, side, side))
    return (1 - 2 * np.sqrt(x * x + y * y + z * z) + 0.1 * noise).astype(np.float32)


VOLUME = Volume(ball(), name="ball")
OTHER = Volume(ball(20), origin=(6, 9, 12), direction=[[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]])
HEAD, SUN = Lighting(lights=(Light("head"),)), Lighting(lights=(Light("directional", (1, 2, 3)),))


def scenes() -> dict[str, dict[str, Any]]:
    kinds = {kind: {"classification": kind} for kind in ("slab", "extinction", "post", "integrated")}
    lit = {f"lit {kind}": {**given, "lighting": HEAD} for kind, given in kinds.items()}
    further = {
        "shadows": {"classification": "extinction", "lighting": replace(SUN, shadows=True)},
        "several": {"classification": "post", "added": (AddedVolume(OTHER, FOG),)},
        "several integrated": {"classification": "integrated", "added": (AddedVolume(OTHER, FOG),)},
        "clipped": {"classification": "post", "clip": (ClipPlane((1, 1, 0.3), 30.0),)},
        "mip": {"mode": "mip"},
        "background": {"classification": "post", "background": (0.2, 0.4, 0.6)},
    }
    return kinds | lit | further


def with_projections() -> list[tuple[str, str]]:
    """Each kind with one projection: neighbours with different ones, and so a classification with light and without."""
    projections = ("orthographic", "perspective")
    return [(kind, projections[(at + at // 4) % 2]) for at, kind in enumerate(scenes())]


@pytest.fixture(scope="module")
def in_five(workers: Workers) -> Iterator[DistributedRenderer]:
    with DistributedRenderer(workers, blocks=5) as several:
        yield several


@pytest.mark.parametrize(("kind", "projection"), with_projections())
def test_pictures_are_those_of_one_process(
    in_five: DistributedRenderer, renderer: Renderer, kind: str, projection: str
) -> None:
    scene = Scene(VOLUME, FOG, **scenes()[kind])
    camera = replace(scene.completed(SIZE).camera, projection=projection)
    scene = replace(scene, camera=camera)
    found, stats = in_five.render(scene, SIZE), in_five.stats
    assert_allclose(found, renderer.render(scene, SIZE), atol=2e-6)
    one = kind == "mip"
    assert len(stats["blocks"]) == (1 if one else 5) and stats["one_block_because"] == ("mode mip" if one else None)
    assert (stats["samples"] and stats["estimated_error"] is not None) or one


@pytest.mark.parametrize("count", [1, 2, 3, 7, 16])
def test_any_number_of_blocks_of_a_store(workers: Workers, renderer: Renderer, tmp_path: Path, count: int) -> None:
    scene = Scene(texvol.load(write_ome(tmp_path / "v.ome.zarr", ball(48), chunk=16)), FOG, classification="post")
    with DistributedRenderer(workers, blocks=count) as several:
        found = several.render(scene, SIZE)
        blocks = several.stats["blocks"]
    assert_allclose(found, renderer.render(scene, SIZE), atol=2e-6)
    assert 1 < len(blocks) <= count or count == len(blocks) == 1
    assert sum(block["parts"]["regions_drawn"] for block in blocks) == quick_stats(renderer)["parts"]["regions_drawn"]


@pytest.mark.parametrize("count", [2, 5, 16])
def test_any_number_of_blocks_of_several_stores(
    workers: Workers, renderer: Renderer, tmp_path: Path, count: int
) -> None:
    """They do not fit in memory together; each region that they have in common is drawn in one block."""
    written = [write_ome(tmp_path / f"{n}.ome.zarr", ball(side), chunk=8) for n, side in enumerate((48, 40))]
    volumes = [texvol.load(path, memory=600_000) for path in written]
    scene = Scene(volumes[0], FOG, classification="post", added=(AddedVolume(volumes[1], FOG),))
    with DistributedRenderer(workers, blocks=count) as several:
        found = several.render(scene, SIZE)
        blocks = several.stats["blocks"]
    assert_allclose(found, renderer.render(scene, SIZE), atol=2e-6)
    assert 1 < len(blocks) <= count
    assert sum(block["parts"]["regions_drawn"] for block in blocks) == quick_stats(renderer)["parts"]["regions_drawn"]


@pytest.mark.parametrize("mode", ["mip", "average"])
def test_numbers_of_a_store_are_drawn_in_parts_by_one_worker(
    workers: Workers, renderer: Renderer, tmp_path: Path, mode: Any
) -> None:
    volume = texvol.load(write_ome(tmp_path / "v.ome.zarr", ball(64), chunk=16), memory=1_040_000)
    scene = Scene(volume, mode=mode)
    with DistributedRenderer(workers, blocks=3) as several:
        found = several.render(scene, SIZE, level=0)
        stats = several.stats
    assert_allclose(found, renderer.render(scene, SIZE, level=0), atol=2e-6)
    assert stats["one_block_because"] == f"mode {mode}" and stats["blocks"][0]["parts"]["regions_drawn"] > 1


def test_an_error_is_kept_and_checked(workers: Workers) -> None:
    pytest.importorskip("numba", reason="needs the oracle: pip install '.[oracle]'")
    with DistributedRenderer(workers) as several:
        several.render(Scene(VOLUME, FOG, classification="post"), SIZE, max_error=0.01, check=64)
        assert several.check is not None and several.check.pixels == 64
        assert several.check.largest_error <= 0.01 and several.stats["estimated_error"] <= 0.01


def test_exact_pictures_are_those_of_one_process(workers: Workers) -> None:
    pytest.importorskip("numba", reason="needs the oracle: pip install '.[oracle]'")
    scene = Scene(VOLUME, FOG, classification="post")
    told: list[float] = []
    assert_array_equal(workers.raycast(scene, (19, 13), told.append), texvol.raycast(scene, (19, 13)))
    assert told[-1] == 1.0 and told == sorted(told)


def test_what_only_a_killed_worker_had_is_sent_again(renderer: Renderer) -> None:
    scene = Scene(VOLUME, FOG, classification="post")
    with Workers(1) as workers, DistributedRenderer(workers) as several:
        several.render(scene, SIZE)
        os.kill(several.stats["blocks"][0]["process"], signal.SIGKILL)
        assert_allclose(several.render(scene, SIZE), renderer.render(scene, SIZE), atol=2e-6)
        os.kill(several.stats["blocks"][0]["process"], signal.SIGKILL)
        assert_array_equal(workers.raycast(scene, (9, 7)), texvol.raycast(scene, (9, 7)))


def test_parts_of_parts_are_sent_each_time(tmp_path: Path) -> None:
    scene = Scene(texvol.load(write_ome(tmp_path / "v.ome.zarr", ball(), chunk=16)), FOG).completed(SIZE)
    scene.volume.overview  # noqa: B018 (a volume of its own, which is kept)
    packer = Packer()
    _, first = packer.pack(scene)
    packer.forget(first)
    content, again = packer.pack(scene)
    assert set(first) == set(again) == set(packer.parts)
    assert isinstance(Unpacker().unpack(content, packer.parts), Scene)


def test_a_part_is_sent_once_and_stays_the_same_object() -> None:
    packer, unpacker = Packer(), Unpacker()
    scene = Scene(VOLUME, FOG, classification="post").completed(SIZE)
    content, digests = packer.pack(scene)
    turned, same = packer.pack(replace(scene, background=(0.5, 0, 0)))
    assert digests == same and content != turned
    one, two = (unpacker.unpack(each, packer.parts) for each in (content, turned))
    assert one.volume is two.volume and one.medium is two.medium and one.background != two.background
    assert_array_equal(one.volume.values, VOLUME.values)
    packer.forget(())
    assert not packer.parts


def test_arguments_out_of_range() -> None:
    with pytest.raises(InputError, match="at least 1"):
        Workers(0)
    with pytest.raises(InputError, match="neither"):
        Workers(address="somewhere")
    with pytest.raises(InputError, match=r"ca\.pem: must be a file"):
        Workers(address="tls://127.0.0.1:1", tls_ca="ca.pem")


def test_the_command_draws_by_workers(
    workers: Workers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By workers that are there: that a command starts its own is held by the test of ctrl-C and by the pages."""
    asked: list[int] = []

    def there(count: int, **_: Any) -> Workers:
        asked.append(count)
        return workers

    monkeypatch.setattr("texvol.distributed.workers.Workers", there)
    monkeypatch.setattr(workers, "close", lambda: None)
    np.save(tmp_path / "ball.npy", ball())
    line = ["render", str(tmp_path / "ball.npy"), "--tf", "fog", "--size", "40x32", "--classification", "post"]
    assert main([*line, "-o", str(tmp_path / "one.exr")]) == 0
    stats = tmp_path / "stats.json"
    assert main([*line, "-o", str(tmp_path / "two.exr"), "--workers", "2", "--stats", str(stats)]) == 0
    assert main(["diff", str(tmp_path / "two.exr"), str(tmp_path / "one.exr"), "--max-abs", "2e-6"]) == 0
    assert len(json.loads(stats.read_text())["blocks"]) == 2 and asked == [2]
    capsys.readouterr()
    assert main([*line, "-o", str(tmp_path / "x.exr"), "--tls-ca", "a.pem"]) == 2
    assert "--dask" in capsys.readouterr().err
    assert main(["raycast", *line[1:], "-o", str(tmp_path / "x.exr"), "--workers", "2", "--progressive"]) == 2
    assert "--progressive" in capsys.readouterr().err


def test_a_killed_worker_changes_nothing(workers: Workers, renderer: Renderer) -> None:
    """The last test of this module: another worker comes in place of the killed one, but only after a while."""
    scene = Scene(VOLUME, FOG, classification="post")
    wanted = renderer.render(scene, SIZE, sampling_rate=8)
    with DistributedRenderer(workers, blocks=6) as several:
        several.render(scene, SIZE)
        victim = several.stats["blocks"][0]["process"]
        killed = threading.Timer(0.05, os.kill, (victim, signal.SIGKILL))
        killed.start()
        deadline = time.monotonic() + 60
        while killed.is_alive() and time.monotonic() < deadline:
            assert_allclose(several.render(scene, SIZE, sampling_rate=8), wanted, atol=2e-6)
        assert_allclose(several.render(scene, SIZE, sampling_rate=8), wanted, atol=2e-6)
        assert victim not in {block["process"] for block in several.stats["blocks"]}
