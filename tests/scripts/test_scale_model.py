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
RATES = model.Throughput(read=100, decode=1000, draw=10, composite=10, network=160, latency=0.001, task=0.01)
PICTURE = model.Picture(size=10e9, compression=0.5, pixels=10**6)


def test_one_worker_reads_decodes_and_draws_and_nothing_else() -> None:
    expected = {"read": 50.0, "decode": 10.0, "draw": 1000.0, "composite": 0.0, "network": 0.0, "schedule": 0.0}
    assert model.terms(PICTURE, 1, RATES) == pytest.approx(expected)
    assert model.seconds(PICTURE, 1, RATES) == pytest.approx(1010)
    assert model.seconds(replace(PICTURE, device=True), 1, RATES) == pytest.approx(1000)
    assert model.limit(PICTURE, 1, RATES) == "draw"


def test_two_workers_have_half_of_the_work_and_one_pair() -> None:
    found = model.terms(PICTURE, 2, RATES)
    assert [found[name] for name in ("read", "decode", "draw")] == pytest.approx([25, 5, 500])
    # The pair: half of the box covers 2^(-2/3) of it; then the whole picture is sent.
    half = 2 ** (-2 / 3)
    assert found["network"] == pytest.approx(0.001 + 0.1 * half + 0.001 + 0.1)
    assert found["composite"] == pytest.approx(0.1)
    assert found["schedule"] == pytest.approx(3 * 0.01)


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
def test_one_worker_composites_nothing(scheme: str) -> None:
    assert set(model.composition(scheme, 10**6, 1, RATES).values()) == {0.0}


@pytest.mark.parametrize("name", ["read", "decode", "draw", "composite", "network"])
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
    shared = replace(RATES, store=200)
    assert model.of_block(PICTURE, 1000, shared)["read"] == pytest.approx(5000 / 200)
    assert model.of_block(PICTURE, 1, shared)["read"] == pytest.approx(50)


def test_a_shared_processor_is_not_doubled_by_a_second_worker() -> None:
    shared = replace(PICTURE, shared=True)
    assert model.of_block(shared, 2, RATES)["draw"] == pytest.approx(1000)
    assert model.of_block(shared, 2, RATES)["read"] == pytest.approx(25)


def test_workers_without_a_chunk_do_nothing() -> None:
    tiny = replace(PICTURE, size=8 * 64**3)
    assert model.of_block(tiny, 8, RATES) == model.of_block(tiny, 10_000, RATES)


@pytest.mark.parametrize(("side", "level"), [(1000, 0), (1999, 0), (2000, 1), (16_000, 4)])
def test_the_level_by_pixels_has_samples_no_farther_apart_than_pixels(side: int, level: int) -> None:
    picture = replace(PICTURE, size=float(side) ** 3)
    assert picture.at_pixels.size == pytest.approx(side**3 / 8**level)
    assert math.sqrt(picture.pixels) <= picture.at_pixels.samples ** (1 / 3) * (1 + 1e-9)


def test_it_is_held_against_a_measurement(tmp_path: Path) -> None:
    path = tmp_path / "measured.json"
    path.write_text(json.dumps({"workers": {"1": 2020.0, "2": 505.0}}))
    found = model.held_against(path, PICTURE, RATES)
    assert found[0] == (1, pytest.approx(1010), 2020.0)
    line = [sys.executable, REPOSITORY / "scripts" / "scale_model.py", "--held-against", path, "--read", "100"]
    rates = ["--decode", "1000", "--draw", "10", "--composite", "10", "--network", "160", "--visible", "1"]
    done = subprocess.run([*line, *rates], capture_output=True, text=True, check=True)
    assert "| 1 | 1.01e+03 | 2.02e+03 | 0.50 | 1.00 | 1.00 |" in done.stdout
    assert "| 100 TB | 10000 |" in done.stdout
