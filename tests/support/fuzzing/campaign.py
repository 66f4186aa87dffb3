"""Damaged files of every kind that texvol reads: each is read or refused, and anything else is a finding.

    python scripts/fuzz.py [--count N | --seconds S] [--seed N] [--kinds nrrd,dicom,…] [--jobs N] [-o DIR]
    python scripts/fuzz.py --only N                       one input again, in this process, and its files in DIR

Input N depends on --seed, --kinds and N alone. First come files made by hand, then sound ones with random damage. They
are read in forked children with limits of time and memory. Outcomes: read; refused (a TexvolError of one line); other
exception; signal (or an exit); time (more than --limit seconds); memory (more than twice what the result takes, and
--memory MiB); printed (on standard output or error); leaked (a descriptor); message (of several lines, or none). DIR
gets the first input of each different finding, with what is known of its cause, and the counts so far. Exit status 1
if there is any finding.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import shutil
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random

from support.fuzzing import readers as fuzz_readers
from support.fuzzing.cases import cases
from support.fuzzing.children import OUTCOMES, READ, REFUSED, Finding, Limits, Results, run
from support.fuzzing.mutations import damaged
from support.fuzzing.mutations_stores import Link, damaged_store
from support.fuzzing.seeds import Seed, seeds
from texvol.util.errors import TexvolError

BLOCK = 500  # inputs of a child
_FURTHER = {"volume": "info", "picture": "diff"}  # what a fraction of the files are read for
_FRACTION = 0.1
# Kinds of which there is a sixth as many inputs: reading them forks.
SLOW = (
    *("dicom", "netcdf", "exodus", "med", "scene", "minc", "fits", "seg-y"),
    *("lif", "nd2", "czi", "gmsh", "vtk", "xdmf", "imaris", "hdf5"),
)

# Kinds whose reading starts threads, which do not outlive a fork: nothing in this process may have read one before.
THREADED = ("zarr",)


class Inputs:
    """Damaged files by number; those of some kinds only, or all but those that are left out."""

    def __init__(self, seed: int = 0, kinds: Sequence[str] = (), *, leaving: Sequence[str] = ()) -> None:
        self.seed = seed
        # Writing them takes seconds, of stores in a process of their own: those of other kinds are not made.
        known = seeds(files=not kinds or not set(kinds) <= set(THREADED), stores=not set(leaving) >= set(THREADED))
        names = [each for each in dict.fromkeys(each.kind for each in known) if each not in leaving]
        if unknown := set(kinds) - set(names):
            raise SystemExit(f"fuzz: there is no kind {', '.join(unknown)}; there are {', '.join(names)}")
        self.kinds = tuple(kinds) or tuple(names)
        self._turns = [kind for turn in range(6) for kind in self.kinds if turn == 0 or not kind.startswith(SLOW)]
        self.sound = {kind: [each for each in known if each.kind == kind] for kind in self.kinds}
        self._cases = [] if set(self.kinds) <= set(THREADED) else [each for each in cases() if each.kind in self.kinds]
        self._others = {kind: [*self.sound[kind][0].files.values()] for kind in self.kinds}
        self.root = ""  # where children put their files
        self._folder = ""
        self._is_warm = False

    @property
    def by_hand(self) -> int:
        """Number of inputs made by hand, which are the first."""
        return len(self._cases)

    def kind_of(self, number: int) -> str:
        """Kind of an input."""
        if number < self.by_hand:
            return self._cases[number].kind
        return self._turns[number % len(self._turns)]

    def made(self, number: int) -> Seed:
        """Input of a number."""
        if number < self.by_hand:
            return self._cases[number]
        random = Random(f"{self.seed} {number}")
        kind = self.kind_of(number)
        sound = random.choice(self.sound[kind])
        if kind in THREADED:
            return replace(sound, files=damaged_store(sound.files, random))
        name = sound.opened if sound.opened and random.random() < 0.8 else random.choice([*sound.files])
        others = self._others[random.choice(self.kinds) if random.random() < 0.2 else kind]
        content = damaged(sound.files[name], random, text=sound.text and name == sound.opened, others=others)
        reader = _FURTHER.get(sound.reader, sound.reader) if random.random() < _FRACTION else sound.reader
        return replace(sound, files={**sound.files, name: content}, reader=reader)

    def attempt(self, number: int) -> int:
        """Bytes of what is read of an input, or TexvolError."""
        made = self.made(number)
        if not self._folder:
            self._folder = os.path.join(self.root, str(os.getpid()))
        # A folder for each seed: a file of another one is not there.
        folder = os.path.join(self._folder, f"{made.kind}-{'-'.join(sorted(made.files))[:99]}-{made.reader}")
        if made.kind in THREADED:  # files of the one before, which may be missing in this one
            shutil.rmtree(folder, ignore_errors=True)
        os.makedirs(folder, exist_ok=True)
        put(made, folder)
        return fuzz_readers.read(made.reader, os.path.join(folder, made.opened), made.options)

    def warm(self) -> None:
        """Read every sound file once, so that children have what reading them imports."""
        import OpenImageIO as oiio

        if self._is_warm:
            return
        self._is_warm = True
        oiio.attribute("threads", 1)  # threads would not be there after a fork
        oiio.attribute("exr_threads", -1)
        with tempfile.TemporaryDirectory() as folder:
            for position, sound in enumerate(itertools.chain(*self.sound.values())):
                if sound.kind in THREADED:
                    continue
                inner = Path(folder) / str(position)
                inner.mkdir()
                put(sound, str(inner))
                fuzz_readers.read(_FURTHER.get(sound.reader, sound.reader), f"{inner}/{sound.opened}", sound.options)


def put(made: Seed, folder: str) -> None:
    """Write the files of an input; what would lie below a file that is none is left out."""
    for name, content in made.files.items():
        path = os.path.join(folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        if isinstance(content, Link):
            os.symlink(os.fsdecode(content), path)
            continue
        with open(path, "wb") as file:
            file.write(content)


def campaign(
    inputs: Inputs,
    numbers: range | Iterator[int],
    limits: Limits = Limits(),  # noqa: B008 (immutable)
    *,
    jobs: int = 1,
    seconds: float = float("inf"),
    output: Path | None = None,
) -> Results:
    """Results of the inputs of these numbers, as many as come in some seconds; findings are kept in `output`."""
    end = time.monotonic() + seconds

    def blocks() -> Iterator[list[int]]:
        rest = iter(numbers)
        while time.monotonic() < end and (block := list(itertools.islice(rest, BLOCK))):
            yield block

    def keep(results: Results, found: Sequence[Finding]) -> None:
        for finding in found:
            different = f"{inputs.kind_of(finding.number)} {finding.signature}"
            if different not in results.signatures:
                results.signatures.add(different)
                _keep(inputs, finding, output)
        for folder in Path(inputs.root).iterdir():  # of children that have ended
            if not Path("/proc", folder.name).exists():
                shutil.rmtree(folder, ignore_errors=True)
        if output is not None and output.is_dir():
            (output / "counts.md").write_text(table(results.counts) + "\n", encoding="utf-8")

    warnings.simplefilter("ignore")
    inputs.warm()
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None) as inputs.root:
        return run(inputs.attempt, blocks(), inputs.kind_of, limits, jobs=jobs, report=keep)


def _keep(inputs: Inputs, finding: Finding, output: Path | None) -> None:
    if output is None:
        return
    made = inputs.made(finding.number)
    folder = output / f"{made.kind}-{finding.outcome.replace(' ', '-')}-{finding.number}"
    folder.mkdir(parents=True, exist_ok=True)
    put(made, str(folder))
    about = {"seed": inputs.seed, "number": finding.number, "opened": made.opened, "reader": made.reader}
    about |= {"options": {key: str(value) for key, value in made.options.items()}, "finding": finding.signature}
    (folder / "about.txt").write_text(f"{json.dumps(about)}\n{finding.text}\n", encoding="utf-8", errors="replace")
    print(f"{made.kind} {finding.number}: {finding.signature}", file=sys.stderr, flush=True)


def table(counts: Mapping[tuple[str, str], int]) -> str:
    """Counts by kind and outcome, as Markdown."""
    shown = [each for each in OUTCOMES[1:] if each in (READ, REFUSED) or any(o == each for _, o in counts)]
    lines = [f"| kind | inputs | {' | '.join(shown)} |", "|---|" + "--:|" * (len(shown) + 1)]
    totals: Counter[str] = Counter()
    for kind in sorted({kind for kind, _ in counts}):
        row = Counter({outcome: counts.get((kind, outcome), 0) for outcome in OUTCOMES})
        totals += row
        lines.append(f"| {kind} | {row.total():,} | {' | '.join(f'{row[each]:,}' for each in shown)} |")
    lines.append(f"| all | {totals.total():,} | {' | '.join(f'{totals[each]:,}' for each in shown)} |")
    return "\n".join(lines)


def _again(inputs: Inputs, number: int, output: Path) -> int:
    made = inputs.made(number)
    folder = output / f"input-{number}"
    folder.mkdir(parents=True, exist_ok=True)
    put(made, str(folder))
    print(f"{made.kind}: {folder / made.opened}, read by {made.reader} {dict(made.options) or ''}")
    try:
        print(f"read: {fuzz_readers.read(made.reader, str(folder / made.opened), made.options)} bytes")
    except TexvolError as error:
        print(f"refused: {error}")
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--count", type=int, metavar="N", help="number of inputs (default: 10000, or what --seconds allows)"
    )
    parser.add_argument("--seconds", type=float, metavar="S", help="begin no more inputs after this time")
    parser.add_argument("--start", type=int, default=0, metavar="N", help="number of the first input")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="another seed makes other inputs")
    parser.add_argument("--kinds", default="", metavar="KIND,…", help="only inputs of these kinds")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="children at a time")
    parser.add_argument("--limit", type=float, default=Limits().seconds, metavar="S", help="seconds for an input")
    parser.add_argument(
        "--memory", type=int, default=Limits().memory >> 20, metavar="MIB", help="for what it is read with"
    )
    parser.add_argument("--only", type=int, metavar="N", help="read input N in this process, and keep it")
    parser.add_argument("-o", "--output", type=Path, default=Path("fuzz"), metavar="DIR", help="where findings go")
    arguments = parser.parse_args()
    inputs = Inputs(arguments.seed, tuple(filter(None, arguments.kinds.split(","))))
    arguments.output.mkdir(parents=True, exist_ok=True)
    if arguments.only is not None:
        return _again(inputs, arguments.only, arguments.output)
    count = arguments.count if arguments.count or arguments.seconds else 10_000
    numbers = range(arguments.start, arguments.start + count) if count else itertools.count(arguments.start)
    limits = Limits(arguments.limit, arguments.memory << 20)
    seconds, begin = arguments.seconds or float("inf"), time.monotonic()
    results = campaign(inputs, numbers, limits, jobs=arguments.jobs, seconds=seconds, output=arguments.output)
    taken = time.monotonic() - begin
    print(table(results.counts))
    total = results.counts.total()
    print(f"\n{total:,} inputs in {taken:.0f} s ({total / taken:.0f} per second, {arguments.jobs} at a time); ", end="")
    print(
        f"slowest: {results.slowest[0]:.2f} s, input {results.slowest[1]}; {len(results.signatures)} different findings"
    )
    return int(bool(results.findings))
