"""The status that a run ends with: pytest's own, but where nothing except pictures failed.

    0    everything passed
    1    a test failed that no picture is to blame for, or a picture is different
    10   all that failed are pictures without a reference: new
    11   all that failed are pictures, none of them different, and some broken: not finite, of another size or another
         number of channels, or unreadable

A different picture is a mistake somewhere, so 1 wins over the others, as do pytest's 2 to 5 (interrupted, internal
error, usage, no tests); a broken one may be, so 11 wins over 10, which only asks for somebody to look.
"""

from __future__ import annotations

from collections.abc import Sequence

from texvol.pytest_plugin.options import BROKEN, NEW

_TESTS_FAILED = 1


def status_of(status: int, picture_failures: Sequence[str], other_failures: int) -> int:
    """The run's status, from pytest's own, the statuses of pictures that failed, and the number of other failures."""
    if status != _TESTS_FAILED or other_failures or not picture_failures or "different" in picture_failures:
        return int(status)
    return BROKEN if "broken" in picture_failures else NEW
