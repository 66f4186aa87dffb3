"""Ray casting of the projection modes xray, average, mip, minip and isosurface: functions of the value along each ray.

`pictures` holds the definitions and makes pictures and depths; `tracer` walks from cell to cell and finds the mean, the
highest value or the first hit of a surface in each.
"""

from __future__ import annotations

from texvol.ray_casting.projection.pictures import isosurface_depth, project

__all__ = ["isosurface_depth", "project"]
