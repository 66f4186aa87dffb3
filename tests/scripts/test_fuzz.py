"""Damaged files are read or refused; the campaign that says so finds each kind of fault where there is one."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from random import Random

import pytest
from support.fuzzing import campaign as fuzz
from support.fuzzing import readers as fuzz_readers
from support.fuzzing.children import LEAKED, MEMORY, MESSAGE, PRINTED, RAISED, READ, REFUSED, SIGNAL, TIME, Limits, run
from support.fuzzing.mutations import damaged
from support.fuzzing.mutations_stores import Link, damaged_store

from texvol import InputError
from texvol.comparison import pictures
from texvol.formats.readers.detection import FORMATS
from texvol.geometry import reading

# Of damaged files: all made by hand, and 30 more of a kind, 5 of slow ones. scripts/fuzz.py tries any number.
COUNT = 1800
STORES = 150
SEED = 18
SCRIPT = Path(__file__).parents[2] / "scripts/fuzz.py"


@pytest.fixture(scope="module")
def inputs() -> fuzz.Inputs:
    return fuzz.Inputs(SEED, leaving=fuzz.THREADED)


@pytest.mark.slow
def test_damaged_files_are_read_or_refused(inputs: fuzz.Inputs, tmp_path: Path) -> None:
    by_hand = fuzz.campaign(inputs, range(inputs.by_hand), output=tmp_path)
    results = fuzz.campaign(inputs, range(inputs.by_hand, COUNT), output=tmp_path)
    counts = by_hand.counts + results.counts
    findings = [*by_hand.findings, *results.findings]
    found = "\n\n".join(f"{inputs.kind_of(each.number)} {each.number}: {each.text}" for each in findings[:5])
    assert not findings, f"{fuzz.table(counts)}\n{found}"
    assert counts.total() == COUNT
    # Else the damage is so slight, or so great, that nothing is learned of the reader. Slow kinds, of each of which
    # there are too few, are counted together, without what was made by hand to be refused.
    read = Counter(kind for kind, outcome in counts.elements() if outcome == READ)
    slow = Counter(outcome for kind, outcome in results.counts.elements() if kind.startswith(fuzz.SLOW))
    assert slow[READ] > 0.1 * slow.total()
    for kind in inputs.kinds:
        assert kind.startswith(fuzz.SLOW) or read[kind] > 0, kind
        assert counts[kind, REFUSED] > 0.05 * COUNT / len(inputs.kinds) or kind == "recent", kind


def test_damaged_stores_are_read_or_refused(tmp_path: Path) -> None:
    """In a process of their own: whoever forks must not have threads of TensorStore."""
    line = [
        sys.executable,
        str(SCRIPT),
        "--seed",
        str(SEED),
        "--kinds",
        "zarr",
        "--count",
        str(STORES),
        "-o",
        str(tmp_path),
    ]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    ((read, refused),) = re.findall(rf"\| zarr \| {STORES} \| (\d+) \| (\d+) \|", done.stdout)
    assert int(read) + int(refused) == STORES
    assert min(int(read), int(refused)) > 0.1 * STORES, "the damage teaches nothing"


def test_damage_of_stores_is_of_every_kind() -> None:
    sound = {"v.zarr/zarr.json": b'{"attributes": {"shape": [1, 2, 3]}}', "v.zarr/0/zarr.json": b'{"shape": [1]}'}
    sound["v.zarr/0/c/0"] = bytes(range(200))
    found = [damaged_store(sound, Random(seed)) for seed in range(1000)]
    assert sum(len(each) < len(sound) for each in found) > 50, "files are missing"
    assert sum(any(isinstance(one, Link) for one in each.values()) for each in found) > 50
    assert sum(each.get("v.zarr/0/c/0", sound["v.zarr/0/c/0"]) != sound["v.zarr/0/c/0"] for each in found) > 100
    texts = [each.get("v.zarr/zarr.json", b"") for each in found]
    assert sum(each != sound["v.zarr/zarr.json"] for each in texts) > 200
    assert any(b"1099511627776" in each for each in texts)
    assert damaged_store(sound, Random(3)) == damaged_store(sound, Random(3))


def test_every_format_that_is_read_is_among_the_kinds(inputs: fuzz.Inputs) -> None:
    known = " ".join(inputs.kinds)
    # Zarr is read by threads, which do not outlive a fork of this process: it is in the campaign below. OpenVDB is read
    # by a process of the system's Python.
    for name in (
        *(each for each in FORMATS if each not in ("Zarr", "OpenVDB")),
        "dicom-rle",
        "dicom-jpeg",
        "dicom-jpeg-ls",
        "dicom-lossless",
        "dicom-jpeg-2000",
    ):
        assert name.lower() in known
    endings = {Path(made.opened).suffix for made in map(inputs.made, range(3000)) if made.reader in ("mesh", "picture")}
    assert endings >= set(reading.FORMATS)
    assert endings >= {".exr", ".png", ".tif", ".jpg"}
    assert set(pictures.FORMATS.values()) == {"EXR", "PNG", "TIFF", "JPEG"}


def test_an_input_depends_on_its_number_alone(inputs: fuzz.Inputs) -> None:
    again = fuzz.Inputs(SEED, leaving=fuzz.THREADED)
    numbers = (0, 700, 3001, 999_999)
    assert [inputs.made(number) for number in numbers[::-1]] == [again.made(number) for number in numbers][::-1]
    assert again.sound == inputs.sound
    again.seed += 1
    assert again.made(3001) != inputs.made(3001)


def test_damage_is_done_to_headers_and_to_samples() -> None:
    sound = b"sizes: 5 4 3\nencoding: raw\n\n" + bytes(range(200)) * 10
    found = {damaged(sound, Random(seed)) for seed in range(2000)}
    assert len(found) > 1800
    assert sum(each.startswith(sound[:30]) for each in found) > 1000
    assert sum(each.endswith(sound[-1900:]) for each in found) > 100
    assert any(b"2147483647" in each for each in found)


KEPT: list[object] = []


def refuse() -> int:
    raise InputError("no")


def refuse_in_two_lines() -> int:
    raise InputError("no\nno")


def fail() -> int:
    return {}["missing"]


def take_memory(result: int) -> int:
    held = bytearray(100 << 20)
    return result + 0 * len(held)


def block_signals() -> int:
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])
    time.sleep(60)
    return 0


def say() -> int:
    os.write(2, b"Corrupt data\n")
    return 0


def leak() -> int:
    KEPT.append(open(os.devnull))  # noqa: SIM115 (it is the fault)
    return 0


FAULTS: dict[str, tuple[str, Callable[[], int]]] = {
    "a result": (READ, lambda: 0),
    "a large result": (READ, lambda: take_memory(100 << 20)),
    "a refusal": (REFUSED, refuse),
    "an exception": (RAISED, fail),
    "an exit": (RAISED, lambda: exit(0)),
    "an abort": (SIGNAL, lambda: os.abort()),
    "an end without a word": (SIGNAL, lambda: os._exit(0)),
    "a crash": (SIGNAL, lambda: os.kill(os.getpid(), signal.SIGSEGV)),  # type: ignore[dict-item,return-value]
    "a hang": (TIME, lambda: time.sleep(60)),  # type: ignore[dict-item,return-value]
    "a hang without signals": (TIME, block_signals),
    "memory": (MEMORY, lambda: take_memory(0)),
    "two lines": (MESSAGE, refuse_in_two_lines),
    "words of a library": (PRINTED, say),
    "an open file": (LEAKED, leak),
}


def test_planted_faults_are_found_and_the_others_go_on() -> None:
    """One campaign with all faults, each between attempts that go well."""
    names = list(FAULTS)

    def attempt(number: int) -> int:
        return FAULTS[names[number // 2]][1]() if number % 2 else 0

    def kind_of(number: int) -> str:
        return f"{'' if number % 2 else 'before '}{names[number // 2]}"

    results = run(attempt, [range(2 * len(names))], kind_of, Limits(seconds=1.0))
    expected = {(name, outcome): 1 for name, (outcome, _) in FAULTS.items()}
    assert dict(results.counts) == expected | {(f"before {name}", READ): 1 for name in names}
    found = [2 * at + 1 for at, name in enumerate(names) if FAULTS[name][0] not in (READ, REFUSED)]
    assert sorted(finding.number for finding in results.findings) == found


def test_a_fault_planted_in_a_reader_is_kept_as_files(
    inputs: fuzz.Inputs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = fuzz_readers.named_limits

    def faulty(path: str) -> object:
        if b"inf" in Path(path).read_bytes():
            os.abort()
        return sound(path)

    monkeypatch.setattr(fuzz_readers, "named_limits", faulty)
    monkeypatch.setattr(fuzz, "seeds", lambda **_: [*chain(*inputs.sound.values())])  # made once
    few = fuzz.Inputs(SEED, ("transform", "limits"))
    monkeypatch.setattr(few, "warm", lambda: None)
    start = 1000  # beyond those made by hand
    results = fuzz.campaign(few, range(start, start + 100), output=tmp_path)
    assert results.counts["limits", SIGNAL] > 5
    assert results.counts.total() == 100
    folder = next(tmp_path.glob("limits-signal-*"))
    assert b"inf" in (folder / "l.toml").read_bytes()
    assert "Aborted" in (folder / "about.txt").read_text()
