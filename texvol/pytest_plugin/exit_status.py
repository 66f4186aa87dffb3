"""Exit status of a run: pytest's own, unless only pictures failed.

    0    everything passed
    1    a test failed for another reason than a picture, or a picture is different
    10   all failures are pictures without a reference: new
    11   all failures are pictures, none of them different, and some broken: not finite, of another size or another
         number of channels, or unreadable

A different picture is certainly a mistake, so 1 takes precedence over the others, as do pytest's 2 to 5 (interrupted,
internal error, usage, no tests). A broken picture is probably a mistake, so 11 takes precedence over 10.
"""

from __future__ import annotations

from collections.abc import Sequence

from texvol.pytest_plugin.options import BROKEN, NEW

_TESTS_FAILED = 1


def status_of(status: int, picture_failures: Sequence[str], other_failures: int) -> int:
    """Return the run's status from pytest's, the statuses of failed pictures, and the number of other failures."""
    if status != _TESTS_FAILED or other_failures or not picture_failures or "different" in picture_failures:
        return int(status)
    return BROKEN if "broken" in picture_failures else NEW
