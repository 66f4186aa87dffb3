"""State that the checks of one process share: the renderer, the claimed names, the report."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texvol.comparison import ci
from texvol.pytest_plugin import junit, references, report
from texvol.pytest_plugin.candidates import Maker
from texvol.pytest_plugin.names import Claims
from texvol.pytest_plugin.pending import Pending
from texvol.pytest_plugin.records import FAILING, RECORDS, plain
from texvol.util import writing
from texvol.util.errors import InputError, TexvolError

if TYPE_CHECKING:
    import pytest

    from texvol.comparison.outcome import Outcome
    from texvol.comparison.pictures import Picture
    from texvol.pytest_plugin.candidates import Candidate


@dataclass(frozen=True)
class Kept:
    """Paths of the candidate and the page that were written."""

    candidate: Path | None = None
    page: Path | None = None


class PictureSession:
    """State of one process that runs tests.

    Parameters
    ----------
    folder : path or None
        Folder of the report.
    shared : path or None
        Folder for messages between workers.
    pending : Pending
        References to be written.
    """

    def __init__(
        self, config: pytest.Config, scratch: Path, folder: Path | None, shared: Path | None, pending: Pending
    ) -> None:
        self._start = config.invocation_params.dir
        self._scratch, self._folder = scratch, folder
        self._self_tests = bool(config.option.texvol_self_test)
        self.claims = Claims(shared)
        self.maker = Maker()
        self.pending = pending

    def close(self) -> None:
        """Close the renderer."""
        self.maker.close()

    def self_test(self, candidate: Candidate, outcome: Outcome) -> dict[str, str]:
        """Return the HTML of the self-test of a picture's limits, for the first scene of the run if requested."""
        if not self._self_tests or candidate.scene is None or not self.claims.first("self-test"):
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

    def said(self, path: Path) -> str:
        """Return a path relative to the folder where pytest was started."""
        relative = os.path.relpath(path, self._start)
        return str(path) if relative.startswith("..") else relative

    def keep(
        self,
        item: pytest.Item,
        record: dict[str, Any],
        outcome: Outcome | None = None,
        metadata: Mapping[str, str] = {},
        picture: Picture | None = None,
    ) -> Kept:
        """Keep the result of a check for pytest's report; write the candidate and the page.

        `picture` is the candidate of a failed check.
        """
        page = self.claims.page(item.nodeid, record["name"])
        root = self._folder or self._scratch
        kept = Kept(root / f"{page}.exr" if picture is not None else None)
        if picture is not None:
            assert kept.candidate is not None
            _make_folder(kept.candidate.parent)
            writing.write_files({kept.candidate: references.encoded(kept.candidate, picture)})
            record = record | {"candidate": str(kept.candidate)}
        # A page shows a pair.
        has_page = outcome is not None and outcome.candidate is not outcome.reference
        if outcome is not None and has_page and (self._folder or record["status"] in FAILING):
            kept = Kept(kept.candidate, root / f"{page}.html")
            assert kept.page is not None
            _make_folder(kept.page.parent)
            back = os.path.relpath(root / "index.html", kept.page.parent) if self._folder else None
            report.write_page(kept.page, outcome, metadata, back)
            record = record | {"page": str(kept.page)}
        if self._folder:
            record = record | report.entry(record, outcome, metadata, f"{page}.html" if has_page else "")
        record = plain(record)
        item.stash.setdefault(RECORDS, []).append(record)
        self._tell_junit(item, record)
        return kept

    def _tell_junit(self, item: pytest.Item, record: dict[str, Any]) -> None:
        result = report.result_of(record)
        item.user_properties.extend(ci.properties(result))
        if getattr(item.config.option, "xmlpath", None) and record["status"] in FAILING:
            item.user_properties.extend((junit.PROPERTY, path) for path in result.attachments)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be created: {error.strerror}") from None
