"""Rays through tetrahedra: the exact picture of a field on an unstructured grid, without resampling."""

from __future__ import annotations

from texvol.ray_casting.tetrahedra.raycast import raycast_tetrahedra

__all__ = ["raycast_tetrahedra"]
