"""Ray casting of geometry: meshes and lines in and around a volume.

`hits` finds the points where rays meet triangles and lines. `layers` orders and shades these points, and composites the
surfaces with the intervals of the medium between them.
"""
