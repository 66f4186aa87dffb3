"""`texvol` and `python -m texvol`: what has to be there before the command line and all that it needs are imported."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from texvol.util.termination import never_lost


def main(line: Sequence[str] | None = None) -> int:
    """Run one command; the exit status. Ctrl-C ends it with one line from the beginning, while libraries load."""
    try:
        with never_lost():
            from texvol.cli import command_line

            return command_line.main(line)
    except KeyboardInterrupt:
        print("texvol: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
