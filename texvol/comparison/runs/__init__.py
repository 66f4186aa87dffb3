"""Reports of runs of picture tests, as `pytest --texvol-report` writes them, after the run.

stored      one report's folder, read and checked
merging     one report of several runs: other systems, drivers, versions of Python
comment     Markdown for a pull request
history     numbers of each picture over many runs, and a small chart of them
"""
