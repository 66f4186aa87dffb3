"""The oracle: ray casting on the CPU, as exact as float64 allows. Every picture can be compared with it.

A ray caster integrates, along the ray of each pixel, the emission q and the extinction τ of the medium:

    I = ∫ q(s) T(s) ds + T(s1) B,    T(s) = exp(-∫ τ(s) ds),    opacity = 1 - T(s1)

q and τ are per world unit, s is the distance from the eye, s1 is where the ray leaves the box, B is the background.
Read `marcher` first: it takes many short steps along each ray, in numpy, in one file. `raycast` computes the same
integral without steps, piece by piece in closed form or by adaptive quadrature; a test holds it against the marcher.
Behind `raycast` stand

- `plain`: one volume without light; the shortest ray caster, and the one to read next,
- `lit`: light, shadows, depth cue, and media that depend on the gradient: a ray is cut wherever the integrand has a
  kink (`cuts`), and each smooth interval in between is halved until its parts agree with the whole (`collocation`),
- `several`: volumes that overlap, masks, labels and colours of samples,
- `projection`: X-ray, average, highest and lowest value, isosurfaces,
- `tetrahedra`: linear fields on unstructured grids, without resampling,
- `surfaces`: meshes and lines,
- `common`: the walk from cell to cell that all of them share, and their polynomials.

The oracle shares no sampling code with the renderer; both start from the same scene and the same rays of the camera.
"""

from __future__ import annotations

from texvol.ray_casting.raycast import raycast, raycast_pixels, raycast_progressively, seconds_per_pixel

__all__ = ["raycast", "raycast_pixels", "raycast_progressively", "seconds_per_pixel"]
