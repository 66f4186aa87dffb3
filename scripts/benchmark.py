"""Speed at equal error, and where the time goes: prints Markdown, section by section.

    python scripts/benchmark.py [--only errors,samples,…] [--data DIR] [--quick]

What is compared is measured in turns within one run, and the medians are what is printed. How settings were chosen is
said on stderr.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmark_timing import Run, machine

ROUNDS, QUICK_ROUNDS = 5, 3
# Section, and the module and function that print it: what a section needs is imported when it is asked for.
SECTIONS = {
    "errors": "benchmark_errors",
    "others": "benchmark_others",
    "samples": "benchmark_samples",
    "empty": "benchmark_skipping",
    "opaque": "benchmark_skipping",
    "slicing": "benchmark_slicing",
    "methods": "benchmark_methods",
    "light": "benchmark_light",
    "gradient": "benchmark_gradients",
    "surfaces": "benchmark_surfaces",
    "growth": "benchmark_growth",
    "bake": "benchmark_growth",
    "memory": "benchmark_commands",
    "cold": "benchmark_commands",
    "orbit": "benchmark_commands",
    "profile": "benchmark_samples",
}


def section(name: str) -> Callable[[Run], None]:
    """The function that prints a section."""
    from importlib import import_module

    found: Callable[[Run], None] = getattr(import_module(SECTIONS[name]), name)
    return found


def chosen_sections(text: str) -> list[str]:
    """Names of sections, in the order of the table, from "errors,samples"."""
    names = [name.strip() for name in text.split(",")]
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        raise argparse.ArgumentTypeError(f"there is no section {', '.join(unknown)}; there are {', '.join(SECTIONS)}")
    return [name for name in SECTIONS if name in names]


def default_data() -> Path:
    """Where the tests look for real volumes."""
    return Path(os.environ.get("TEXVOL_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data")


def main() -> None:
    """Print the sections that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", type=chosen_sections, default=list(SECTIONS), metavar="SECTION,…")
    parser.add_argument("--data", type=Path, default=default_data(), help="folder of real volumes")
    parser.add_argument("--quick", action="store_true", help="smaller volumes, fewer turns")
    parser.add_argument("--rounds", type=int, help="turns that everything gets")
    parser.add_argument(
        "--scenes",
        default="",
        metavar="PART,…",
        help="of `errors` and `others`, only scenes, of `methods`, only methods with this in the name",
    )
    parser.add_argument("--page", action="store_true", help="put what `others` measures into the documentation")
    arguments = parser.parse_args()
    rounds = arguments.rounds or (QUICK_ROUNDS if arguments.quick else ROUNDS)
    scenes = tuple(filter(None, arguments.scenes.split(",")))
    start = time.perf_counter()
    print(machine())
    with tempfile.TemporaryDirectory(prefix="texvol-benchmark-") as folder:
        for name in arguments.only:
            section(name)(Run(arguments.data, arguments.quick, rounds, Path(folder), scenes, arguments.page))
    busy = os.getloadavg()[2]
    minutes = (time.perf_counter() - start) / 60
    print(f"\n{minutes:.0f} minutes; {busy:.1f} processes running, on average over the last 15.")


if __name__ == "__main__":
    main()
