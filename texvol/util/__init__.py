"""Tools without any knowledge of volumes: errors, text, files that are written whole, threads, statistics."""
