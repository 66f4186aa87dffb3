"""Random actions of mouse, keyboard and window, as in tests/window/test_window_random.py, in any number.

    python scripts/window_actions.py [--actions 600] [--seeds 1,2]

Each series is played to a window of one volume, and to one of two channels over time.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from support.random_actions import FREED_AT_ONCE, channels_over_time, check_window
from support.windows import ball, display_of_all


def main() -> None:
    """Play the series; an AssertionError has the reason why one has failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--actions", type=int, default=600, help="of each series; half of them are played three times")
    parser.add_argument("--seeds", default="1,2", help="one series for each")
    asked = parser.parse_args()
    os.environ.update(FREED_AT_ONCE)
    for seed in map(int, asked.seeds.split(",")):
        for opens in (ball, channels_over_time):
            with tempfile.TemporaryDirectory() as folder:
                name = opens(Path(folder))
                check_window(display_of_all(), Path(folder), name, seed, asked.actions, asked.actions // 2)
                print(f"seed {seed}, {name}: {asked.actions} actions leave the window whole", flush=True)


if __name__ == "__main__":
    main()
