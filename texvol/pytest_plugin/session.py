"""State that the checks of one process share: the renderer, the claimed names, the report."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from texvol.comparison import ci
from texvol.pytest_plugin import options, references, report
from texvol.pytest_plugin.candidates import Maker
from texvol.pytest_plugin.names import Claims
from texvol.pytest_plugin.pending import Pending
from texvol.pytest_plugin.records import RECORDS, Record, plain
from texvol.pytest_plugin.summary import ATTACHMENT
from texvol.util import writing
from texvol.util.errors import InputError, TexvolError

if TYPE_CHECKING:
    import pytest

    from texvol.comparison.outcome import Outcome
    from texvol.pytest_plugin.candidates import Candidate


class PictureSession:
    """State of one process that runs tests; without a report, pictures and pages are written to `scratch`."""

    def __init__(self, config: pytest.Config, scratch: Path) -> None:
        shared = options.shared_folder(config)
        self._has_report = options.report_folder(config) is not None
        self._root = options.report_folder(config) or scratch
        self._self_tests = bool(config.option.texvol_self_test)
        self.claims = Claims(shared if options.is_worker(config) else scratch)
        self.maker = Maker()
        self.pending = Pending(shared)

    def self_test(self, candidate: Candidate, outcome: Outcome) -> dict[str, str]:
        """Return the HTML of the self-test of a picture's limits, for the first scene of the run if requested."""
        if not self._self_tests or candidate.scene is None or not self.claims.is_mine("self-test"):
            return {}
        self._self_tests = False
        from texvol.comparison import self_test, self_test_page
        from texvol.provenance.stored_scene import StoredScene

        stored = StoredScene(candidate.scene, candidate.settings, name=outcome.name)
        try:
            found = self_test.self_test(stored, candidate.size, outcome.limits)
        except TexvolError as error:
            return {"self_test": self_test_page.failure(outcome.name, error)}
        return {"self_test": self_test_page.fragment(found)}

    def keep(self, item: pytest.Item, record: Record, outcome: Outcome | None, metadata: Mapping[str, str]) -> Record:
        """Keep the record of a check for pytest's report; write the candidate of a failed check, and a page of a pair.

        Returns
        -------
        dict
            The record with the paths `candidate` and `page`.
        """
        page = self.claims.page(item.nodeid, record["name"])
        failed = record["status"] in ci.FAILING
        if outcome is not None and failed:
            path = self._root / f"{page}.exr"
            record = record | {"candidate": _write(path, references.encoded(path, outcome.candidate))}
        has_page = outcome is not None and outcome.candidate is not outcome.reference
        if outcome is not None and has_page and (self._has_report or failed):
            path = self._root / f"{page}.html"
            back = os.path.relpath(self._root / "index.html", path.parent) if self._has_report else None
            record = record | {"page": _write(path, report.page_of(outcome, metadata, back))}
        if self._has_report:
            record = record | report.entry(record, outcome, metadata, f"{page}.html" if has_page else "")
        record = plain(record)
        item.stash.setdefault(RECORDS, []).append(record)
        result = report.result_of(record)
        item.user_properties.extend(ci.properties(result))
        if getattr(item.config.option, "xmlpath", None) and failed:
            item.user_properties.extend((ATTACHMENT, path) for path in result.attachments)
        return record


def _write(path: Path, content: bytes) -> str:
    """Write a file into a folder that is created if missing, and return its path."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path.parent}: cannot be created: {error.strerror}") from None
    writing.write_files({path: content})
    return str(path)
