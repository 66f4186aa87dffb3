"""Reports of runs of picture tests, as `pytest --texvol-report` writes them, after the run.

    stored         one report's folder, read and checked
    rows           pictures of several runs beside each other
    merging        one report of several runs: other systems, drivers, versions of Python
    merged_page    its page
    comment        Markdown for a pull request
    commits        commit of the source that a run tests
    history        runs in time, kept in a file that each run is added to
    changes        what became of each picture from run to run
    history_page   its page

No module of these needs pytest.
"""
