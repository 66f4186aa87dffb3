"""The oracle: a ray caster in float64 that integrates each ray without a step length, see `raycast`."""

from __future__ import annotations

from texvol.ray_casting.raycast import raycast, raycast_pixels, seconds_per_pixel

__all__ = ["raycast", "raycast_pixels", "seconds_per_pixel"]
