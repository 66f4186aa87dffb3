"""Triangles and lines on the device: projected, sorted by depth and drawn between the slabs of the volume."""
