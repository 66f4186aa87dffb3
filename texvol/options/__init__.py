"""Options of the command line and keys of scene files, and the scene that they describe.

Each group of options is one file. An option has one meaning, whether it stands on the command line or in a TOML file.
"""
