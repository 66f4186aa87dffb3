"""Random scenes that are hard on a renderer, and their outcomes."""
