"""End of a run: the report's index, the exit status, and the messages for the terminal and a CI system."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from texvol.pytest_plugin import options
from texvol.pytest_plugin.records import Gathered, counted, first
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.shown_text import shown_line

if TYPE_CHECKING:
    pass

ATTACHMENT = "texvol_attachment"  # property of a test case
_MOST_LINES = 20  # on written references


def status_of(status: int, picture_failures: Sequence[str], other_failures: int) -> int:
    """Return the run's status from pytest's, the statuses of failed pictures, and the number of other failures.

        0    everything passed
        1    a test failed for another reason than a picture, or a picture is different
        10   all failures are pictures without a reference: new
        11   all failures are pictures, none of them different, and some broken: not finite, of another size or another
             number of channels, or unreadable

    A different picture is certainly a mistake, so 1 takes precedence over the others, as do pytest's 2 to 5
    (interrupted, internal error, usage, no tests). A broken picture is probably a mistake, so 11 takes precedence over
    10.
    """
    if status != 1 or other_failures or not picture_failures or "different" in picture_failures:
        return status
    return options.BROKEN if "broken" in picture_failures else options.NEW


class Reporter:
    """Hooks of the controller process."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._gathered = Gathered()
        self._notes: list[str] = []

    def pytest_sessionstart(self) -> None:
        """Create the report's folder, or raise UsageError before any test runs."""
        folder = options.report_folder(self._config)
        if folder is None or self._config.option.collectonly:
            return
        from texvol.pytest_plugin import report

        try:
            report.prepare(folder)
        except InputError as error:
            raise pytest.UsageError(f"--texvol-report {error}") from None

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._gathered.add(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self._gathered.other_failures += 1

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write the report and set the exit status; pytest has written its own files before."""
        gathered, config = self._gathered, self._config
        self._write_references(session)
        if options.own_exit_status(config):
            session.exitstatus = status_of(int(session.exitstatus), gathered.picture_failures, gathered.other_failures)
        folder = options.report_folder(config)
        try:
            if folder is not None and not config.option.collectonly and folder.is_dir():
                from texvol.pytest_plugin import report

                report.finish(folder, gathered.records, int(session.exitstatus))
            if gathered.records and getattr(config.option, "xmlpath", None):
                _add_attachments(Path(os.path.expandvars(os.path.expanduser(config.option.xmlpath))))
        except InputError as error:
            self._notes.append(str(error))
            session.exitstatus = int(session.exitstatus) or 1
        if gathered.records:
            from texvol.pytest_plugin.tables import stale_tables

            self._notes += stale_tables(session, gathered.records)

    def _write_references(self, session: pytest.Session) -> None:
        """Move the pictures of --texvol-update to their places, now that all tests have run."""
        if not options.updates(self._config):
            return
        from texvol.pytest_plugin.pending import Pending

        refused, no_errors = Pending(options.shared_folder(self._config)).commit()
        self._gathered.refuse(refused)
        self._notes += [f"not written: {reason}" for reason in refused.values()]
        if not no_errors:
            session.exitstatus = int(session.exitstatus) or 1

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Print the number of pictures, their drivers, and the path of the report."""
        records, notes = self._gathered.records, self._notes
        folder = options.report_folder(self._config)
        if not records and not notes:
            return
        terminalreporter.section("pictures")
        drivers = sorted({record["driver"] for record in records if record.get("driver")})
        drawn_by = ", ".join(drivers) or "an unknown driver"
        written = [line for record in records if record["status"] == "updated" for line in record["message"]]
        lines = [f"{counted(records)}; drawn by {drawn_by}", *first(written, _MOST_LINES), *notes]
        if folder is not None:
            lines.append(f"report: {folder / 'index.html'}")
        for line in lines:
            terminalreporter.write_line(shown_line(line))
        from texvol.comparison import ci

        if ci.on_github():
            from texvol.pytest_plugin.report import result_of

            for line in ci.tell([result_of(record, folder) for record in records]):
                terminalreporter.write_line(line)


def _add_attachments(path: Path) -> None:
    """Move the attachments of each test case in a JUnit file from its properties to its output.

    A pytest plugin cannot write `system-out`, so the file is changed after pytest has written it.

    Raises
    ------
    InputError
        If the file can't be written.
    """
    from xml.etree import ElementTree

    from texvol.comparison.ci import attachment

    try:
        tree = ElementTree.parse(path)
    except (OSError, ElementTree.ParseError):
        return  # pytest wrote none
    changed = False
    for case in tree.iter("testcase"):
        all_properties = [(group, each) for group in case.findall("properties") for each in group]
        found = [(group, each) for group, each in all_properties if each.get("name") == ATTACHMENT]
        for group, each in found:
            group.remove(each)
        if found:
            output = case.find("system-out")
            output = ElementTree.SubElement(case, "system-out") if output is None else output
            lines = [attachment(each.get("value", "")) for _, each in found]
            output.text = "\n".join([*([output.text] if output.text else []), *lines, ""])
            changed = True
    if changed:
        content = ElementTree.tostring(tree.getroot(), encoding="utf-8", xml_declaration=True)
        writing.write_files({path: content})
