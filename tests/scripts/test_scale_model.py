"""The model of many workers: exact where it can be worked out by hand, and never faster than what limits it."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
sys.path.insert(0, str(REPOSITORY / "scripts"))

import scale_model as model  # noqa: E402

# Powers of ten, so that seconds can be worked out by hand.
RATES = model.Throughput(
    read=100, decode=1000, prepare=100, draw=10, composite=10, network=160, latency=0.001, task=0.01, picture=0.05,
    start=3.0, start_processor=2.0,
)  # fmt: skip
# A chunk along each axis, so that none is decoded twice, and 1000 slabs.
PICTURE = model.Picture(size=1e9, compression=0.5, pixels=10**6, chunk=1000, visible=1.0)
CHUNKED = replace(PICTURE, size=8e9, chunk=100)  # 20 chunks along an axis, 2000 slabs


def test_one_worker_reads_decodes_prepares_draws_and_sends_its_picture() -> None:
    expected = {"read": 5.0, "decode": 1.0, "prepare": 10.0, "draw": 100.0, "composite": 0.0, "network": 0.101}
    rest = {"schedule": 0.05 + 3 * 0.01, "start": 0.0}
    assert model.terms(PICTURE, 1, RATES) == pytest.approx(expected | rest)
    assert model.seconds(PICTURE, 1, RATES) == pytest.approx(1 + 10 + 100 + 0.101 + 0.08)
    assert model.seconds(replace(PICTURE, device=True), 1, RATES) == pytest.approx(100 + 0.101 + 0.08)
    assert model.limit(PICTURE, 1, RATES) == "draw"


def test_two_workers_have_half_of_the_work_and_one_pair() -> None:
    found = model.terms(CHUNKED, 2, RATES)
    # Cut across one axis: each takes 10 of 20 chunks along it, and one beyond the cut.
    assert [found[name] for name in ("read", "decode")] == pytest.approx([20 * 1.1, 4 * 1.1])
    assert [found[name] for name in ("prepare", "draw")] == pytest.approx([40, 100])
    # The pair: half of the box covers 2^(-2/3) of it; then the whole picture is sent.
    half = 2 ** (-2 / 3)
    assert found["network"] == pytest.approx(0.001 + 0.1 * half + 0.001 + 0.1)
    assert found["composite"] == pytest.approx(0.1)
    assert found["schedule"] == pytest.approx(0.05 + (3 * 2 + 1) * 0.01)


def test_chunks_at_the_borders_of_blocks_are_decoded_by_both() -> None:
    assert model.decoded_twice(CHUNKED, 1) == 1
    # 8 blocks: along each axis both halves of 20 chunks take one more.
    assert model.decoded_twice(CHUNKED, 8) == pytest.approx(1.1**3)
    # 64 blocks: of four along an axis the inner two take two more.
    assert model.decoded_twice(CHUNKED, 64) == pytest.approx((1 + 6 / 20) ** 3)
    # A chunk has 26 neighbours, and blocks of one chunk take no more than these.
    assert model.decoded_twice(CHUNKED, 10**6) <= 27


def test_what_is_done_at_the_same_time_does_not_limit() -> None:
    slow = replace(RATES, read=9.0)  # 56 s, more than any other but drawing on a slower processor
    halves = replace(slow, decode=1000 / 40, prepare=1000 / 45)  # 40 and 45 s, together more than reading
    drawn = replace(PICTURE, device=True, pixels=10**5)  # 10 s
    assert (model.limit(drawn, 1, slow), model.limit(drawn, 1, halves)) == ("read", "prepare")
    assert model.seconds(drawn, 1, slow) == pytest.approx(500 / 9 + 0.001 + 0.01 + 0.08)
    assert model.seconds(drawn, 1, halves) == pytest.approx(85 + 0.001 + 0.01 + 0.08)


def test_slabs_along_rays_are_drawn_and_samples_of_the_volume_are_prepared() -> None:
    larger = replace(PICTURE, size=8 * PICTURE.size)
    one, other = model.of_block(PICTURE, 1, RATES), model.of_block(larger, 1, RATES)
    assert other["draw"] == pytest.approx(2 * one["draw"])
    assert other["prepare"] == pytest.approx(8 * one["prepare"])
    assert model.of_block(replace(PICTURE, rate=3.0), 1, RATES)["draw"] == pytest.approx(3 * one["draw"])


def test_a_picture_whose_texels_are_there_is_only_drawn() -> None:
    found = model.of_block(replace(PICTURE, again=True), 1, RATES)
    assert found == {"read": 0.0, "decode": 0.0, "prepare": 0.0, "draw": pytest.approx(100)}


def test_processes_that_have_just_begun_take_their_start() -> None:
    begun = replace(PICTURE, just_begun=True)
    assert model.seconds(begun, 4, RATES) == pytest.approx(model.seconds(PICTURE, 4, RATES) + 3)
    # On two cores four of them take turns.
    assert model.terms(replace(begun, shared=2), 4, RATES)["start"] == pytest.approx(6)
    assert model.processor_seconds(begun, 1, RATES) == pytest.approx(1 + 10 + 100 + 2)


def test_a_tree_of_eight_by_hand() -> None:
    found = model.composition("tree", 10**6, 8, RATES)
    area = [(2**stage / 8) ** (2 / 3) for stage in range(4)]
    assert found["composite"] == pytest.approx(0.1 * sum(area[1:]))
    assert found["network"] == pytest.approx(4 * 0.001 + 0.1 * (sum(area[:3]) + 1))


def test_direct_send_is_one_round_in_which_a_worker_meets_the_blocks_along_a_ray() -> None:
    found = model.composition("direct send", 10**6, 1000, RATES)
    assert found["composite"] == pytest.approx(0.1 / 100)
    assert found["network"] == pytest.approx(10 * 0.001 + 0.1 / 100 + 10 * 0.001 + 0.1)


def test_binary_swap_is_radix_2() -> None:
    found = model.composition("radix-k", 10**6, 4, RATES, radix=2)
    first, second = (1 / 4) ** (2 / 3) / 2, (2 / 4) ** (2 / 3) / 4
    assert found["composite"] == pytest.approx(0.1 * (first + second))
    assert found["network"] == pytest.approx(2 * 0.001 + 0.1 * (first + second) + 2 * 0.001 + 0.1)


@pytest.mark.parametrize("scheme", model.SCHEMES)
def test_one_worker_composites_nothing_and_sends_its_picture(scheme: str) -> None:
    assert model.composition(scheme, 10**6, 1, RATES) == {"composite": 0.0, "network": pytest.approx(0.101)}


@pytest.mark.parametrize("name", ["read", "decode", "prepare", "draw", "composite", "network"])
def test_what_is_faster_makes_no_picture_slower(name: str) -> None:
    faster = replace(RATES, **{name: 2 * getattr(RATES, name)})
    for size in model.SIZES:
        for workers in model.WORKERS:
            picture = replace(PICTURE, size=size)
            before, after = (model.seconds(picture, workers, each) for each in (RATES, faster))
            assert after <= before
            if model.limit(picture, workers, RATES) == name:
                assert after < before


def test_a_shared_store_bounds_all_workers_together() -> None:
    shared, alone = replace(RATES, store=200), replace(RATES, store=1e9)
    assert model.of_block(PICTURE, 1, shared)["read"] == pytest.approx(5)
    twice = model.decoded_twice(CHUNKED, 1000)
    assert model.of_block(CHUNKED, 1000, shared)["read"] == pytest.approx(4000 * twice / 200)
    assert model.of_block(CHUNKED, 1000, alone)["read"] == pytest.approx(4 * twice / 100)


def test_workers_that_share_cores_have_no_more_of_them_together() -> None:
    one_core = replace(CHUNKED, shared=1)
    assert model.of_block(one_core, 2, RATES)["draw"] == pytest.approx(model.of_block(one_core, 1, RATES)["draw"])
    # A worker that keeps one and a half of two cores busy leaves half of one to a second, and each then has one.
    some = replace(RATES, cores=1.5, draw_cores=1.25)
    one, two = (model.of_block(replace(CHUNKED, shared=2), workers, some) for workers in (1, 2))
    assert one["prepare"] / two["prepare"] == pytest.approx(2 / 1.5)
    assert one["draw"] / two["draw"] == pytest.approx(2 / 1.25)
    # Processor seconds are the same, however many cores there are.
    assert model.processor_seconds(one_core, 2, some) == pytest.approx(model.processor_seconds(CHUNKED, 2, RATES))


def test_workers_without_a_chunk_do_nothing() -> None:
    tiny = replace(PICTURE, size=8 * 64**3, chunk=64)
    assert model.of_block(tiny, 8, RATES) == model.of_block(tiny, 10_000, RATES)


@pytest.mark.parametrize(("side", "level"), [(1000, 0), (1999, 0), (2000, 1), (16_000, 4)])
def test_the_level_by_pixels_has_samples_no_farther_apart_than_pixels(side: int, level: int) -> None:
    picture = replace(PICTURE, size=float(side) ** 3)
    assert picture.at_pixels.size == pytest.approx(side**3 / 8**level)
    assert math.sqrt(picture.pixels) <= picture.at_pixels.samples ** (1 / 3) * (1 + 1e-9)


def test_it_is_held_against_a_measurement(tmp_path: Path) -> None:
    path = tmp_path / "measured.json"
    picture = {"size": 1e9, "pixels": 10**6, "chunk": 1000, "compression": 0.5, "shared": 2}
    told = {"picture": picture, "first": {"1": [57.0905, 226.0]}, "again": {"1": [50.0905, 50.0], "2": [1.0, 1.0]}}
    path.write_text(json.dumps(told))
    two_cores = replace(RATES, cores=2.0, draw_cores=2.0)
    first, again, by_two = model.held_against(path, two_cores)
    # Decoded, prepared and drawn by two cores, sent, scheduled, and the start of the process.
    assert first.predicted == pytest.approx((111 / 2 + 0.181 + 3, 111 + 2))
    assert again.predicted == pytest.approx((100 / 2 + 0.181, 100))
    assert (by_two.kind, by_two.workers, by_two.measured) == ("again", 2, (1.0, 1.0))


def test_the_command_prints_predictions_beside_the_measurement(tmp_path: Path) -> None:
    path = tmp_path / "measured.json"
    told = {"picture": {"size": 1e9, "pixels": 10**6, "chunk": 1000}, "first": {}, "again": {"1": [200.0, 50.0]}}
    path.write_text(json.dumps(told))
    line = [sys.executable, REPOSITORY / "scripts" / "scale_model.py", "--held-against", path]
    rates = ["--draw", "10", "--draw-cores", "2", "--network", "160", "--picture", "0.05", "--task", "0.01"]
    done = subprocess.run([*line, *rates], capture_output=True, text=True, check=True)
    assert "| again | 1 | 50.2 | 200 | 0.25 | 100 | 50 | 2.00 | draw |" in done.stdout
    assert "| 100 TB | 10000 |" in done.stdout
