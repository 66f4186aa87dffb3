"""Plants mistakes one after the other in a copy of the source tree, and shows that each turns a test red.

    python scripts/planted_mistakes.py                  plant all mistakes of planted_mistake_list.py
    python scripts/planted_mistakes.py --only shaders   plant those whose place or words contain this
    python scripts/planted_mistakes.py --check          only see that every mistake fits the present source
    python scripts/planted_mistakes.py --write          also write texvol/docs/planted-mistakes.md
    python scripts/planted_mistakes.py --skip-green     where all tests have just passed: only run them with mistakes

A mistake changes one function. In Python the function is found by its name, and the text that is replaced must stand
in it exactly once; in a shader by its signature, see texvol/comparison/wrong_functions.py. The tests of a mistake are
green without it. With it a test must fail: a mistake that only keeps pytest from collecting tests is no proof.

Exit status: 0 every mistake turned a test red, 1 some did not, 2 a mistake does not fit the source, or a test is red
without one.
"""

from __future__ import annotations

import argparse
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from planted_mistake_list import MISTAKES
from planted_mistake_sources import DoesNotFitError, Mistake, changed_files, uncovered

from texvol.opengl.shaders import ShaderError

REPOSITORY = Path(__file__).parents[1]
PAGE = "texvol/docs/planted-mistakes.md"
COPIED = ("texvol", "shaders", "tests", "scripts", "pyproject.toml", "README.md", "LICENSE")
TIMEOUT = 300.0  # seconds of one run of tests
_VARIABLE = re.compile(r"^([A-Z_]+)=(\S+) ")


@dataclass(frozen=True)
class Outcome:
    """Outcome of one run of tests: pytest's exit status, the names of the tests that failed, and the time it took."""

    status: int
    failed: tuple[str, ...]
    seconds: float
    output: str

    @property
    def is_green(self) -> bool:
        """True if tests ran and all of them passed."""
        return self.status == 0 and re.search(r"\d+ passed", self.output) is not None

    @property
    def is_red(self) -> bool:
        """True if a test ran and failed."""
        return self.status == 1 and bool(self.failed)


class RedWithoutMistakeError(Exception):
    """Tests are not green without a mistake."""


@contextmanager
def copy_of_tree(folder: Path) -> Iterator[Path]:
    """Copy of the source tree in a folder."""
    for name in COPIED:
        source = REPOSITORY / name
        if source.is_dir():
            shutil.copytree(source, folder / name)  # with what numba has compiled
        else:
            shutil.copy2(source, folder / name)
    yield folder


@contextmanager
def planted(tree: Path, mistake: Mistake) -> Iterator[None]:
    """The tree with a mistake; its files are restored afterwards, with their times, so that caches stay valid."""
    changed = changed_files(tree, mistake)
    kept = {path: (path.read_bytes(), path.stat()) for path in changed}
    try:
        for path, text in changed.items():
            path.write_text(text, encoding="utf-8")
        yield
    finally:
        for path, (content, status) in kept.items():
            path.write_bytes(content)
            os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def run_tests(tree: Path, tests: str) -> Outcome:
    """Run some tests of a tree: a variable, names of files in tests/, and options of pytest."""
    environment = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1", "PYTEST_ADDOPTS": ""}
    environment |= {name: value for name, value in _VARIABLE.findall(tests)}
    options = ["-o", "addopts=", "-p", "no:cacheprovider", "-p", "no:xdist"]
    command = [sys.executable, "-m", "pytest", "-x", "-rf", *options, *arguments_of(tree, tests)]
    start = time.perf_counter()
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, text=True, timeout=TIMEOUT, check=False
        )
        status, output = done.returncode, done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        status, output = -1, f"no end after {TIMEOUT:g} s"
    failed = re.findall(r"^FAILED \S+?::(\S+)", output, re.MULTILINE)[-1:]  # a test may have run others
    return Outcome(status, tuple(failed), time.perf_counter() - start, output)


def arguments_of(tree: Path, tests: str) -> list[str]:
    """Arguments of pytest: each name of a test file becomes its path in the tree.

    Raises
    ------
    DoesNotFitError
        If tests/ does not have exactly one file of a name.
    """
    words = [word.strip("'") for word in re.findall(r"'[^']*'|\S+", _VARIABLE.sub("", tests))]
    files = _test_files(tree)
    found = {name: [path for path in files if path.name == name] for name in words if name.endswith(".py")}
    for name, paths in found.items():
        if len(paths) != 1:
            raise DoesNotFitError(f"tests/ must have one file {name}, found {len(paths)}")
    return [str(found[word][0].relative_to(tree)) if word in found else word for word in words]


@cache
def _test_files(tree: Path) -> list[Path]:
    return sorted((tree / "tests").rglob("*.py"))


def run_all(mistakes: list[Mistake], copies: int, *, skip_green: bool) -> list[tuple[Mistake, Outcome]]:
    """Plant the mistakes, as many at a time as there are copies of the tree; each next to its outcome."""
    trees: queue.SimpleQueue[Path] = queue.SimpleQueue()

    def clean_run(tests: str) -> Outcome:
        tree = trees.get()
        try:
            return run_tests(tree, tests)
        finally:
            trees.put(tree)

    def red_run(mistake: Mistake) -> Outcome:
        tree = trees.get()
        try:
            with planted(tree, mistake):
                outcome = run_tests(tree, mistake.tests)
        finally:
            trees.put(tree)
        print(f"{'red  ' if outcome.is_red else 'GREEN'} {outcome.seconds:5.1f} s  {mistake}", flush=True)
        return outcome

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="texvol-mistakes-")))
        for number in range(copies):
            (folder / str(number)).mkdir()
            trees.put(stack.enter_context(copy_of_tree(folder / str(number))))
        threads = stack.enter_context(ThreadPoolExecutor(copies))
        tests = [] if skip_green else list(dict.fromkeys(mistake.tests for mistake in mistakes))
        red = []
        for name, outcome in zip(tests, threads.map(clean_run, tests), strict=True):
            print(f"{'green' if outcome.is_green else 'RED  '} {outcome.seconds:5.1f} s  {name}", flush=True)
            red += [] if outcome.is_green else [f"{name}: {outcome.output[-2000:]}"]
        if red:
            raise RedWithoutMistakeError("\n\n".join(red))
        return list(zip(mistakes, threads.map(red_run, mistakes), strict=True))


def page_of(outcomes: list[tuple[Mistake, Outcome]], seconds: float) -> str:
    """The page of the table."""
    rows = [
        f"| `{mistake.place}` | {mistake.words} | `{outcome.failed[0] if outcome.is_red else 'none'}` "
        f"| {outcome.seconds:.1f} |"
        for mistake, outcome in outcomes
    ]
    red = sum(outcome.is_red for _, outcome in outcomes)
    lines = [
        "# Planted mistakes",
        "",
        "A test that cannot fail proves nothing. `python scripts/planted_mistakes.py --write` plants the mistakes of",
        "this table one after the other in a copy of the source tree, at least one in each package and in each shader",
        "file. For each mistake it runs some tests, which are green without it, and names the first test that fails.",
        "",
        f"{red} of {len(outcomes)} mistakes turned a test red, in {seconds / 60:.0f} minutes.",
        "",
        "| place | mistake | test that turned red | seconds |",
        "|---|---|---|---|",
        *rows,
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Plant the mistakes that are asked for; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--only", default="", metavar="TEXT", help="mistakes whose place or words contain TEXT")
    parser.add_argument("--check", action="store_true", help="only see that every mistake fits the source")
    parser.add_argument("--write", action="store_true", help=f"write {PAGE}")
    parser.add_argument("--copies", type=int, default=2, help="mistakes at a time (2)")
    parser.add_argument("--skip-green", action="store_true", help="leave out the runs of tests without mistakes")
    arguments = parser.parse_args()
    start = time.perf_counter()
    chosen = [mistake for mistake in MISTAKES if arguments.only in str(mistake)]
    try:
        missing = uncovered(REPOSITORY, MISTAKES)
        if missing:
            raise DoesNotFitError(f"a mistake must be planted in {', '.join(missing)}")
        for mistake in MISTAKES:
            arguments_of(REPOSITORY, mistake.tests)
        if arguments.check:
            print(f"{len(MISTAKES)} mistakes fit the source")
            return 0
        outcomes = run_all(chosen, arguments.copies, skip_green=arguments.skip_green)
    except (DoesNotFitError, ShaderError, RedWithoutMistakeError) as error:
        print(error, file=sys.stderr)
        return 2
    seconds = time.perf_counter() - start
    red = sum(outcome.is_red for _, outcome in outcomes)
    print(f"{red} of {len(outcomes)} mistakes turned a test red, in {seconds / 60:.1f} minutes")
    if arguments.write:
        (REPOSITORY / PAGE).parent.mkdir(exist_ok=True)
        (REPOSITORY / PAGE).write_text(page_of(outcomes, seconds), encoding="utf-8")
    return 0 if red == len(outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
