"""Helpers of the tests: scenes, files, closed forms, windows, browsers."""
