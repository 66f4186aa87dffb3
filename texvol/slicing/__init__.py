"""Geometry of slicing: view-aligned slabs and their polygons, bricks of a large volume, cells with value ranges."""
