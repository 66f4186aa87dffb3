"""Meshes and lines on rays: hits, their order and colours."""
