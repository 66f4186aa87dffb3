"""Meshes and lines as data: what is refused, in one line that says what came."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from texvol import InputError
from texvol.geometry import Lines, Mesh

CORNERS = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
TRIANGLES = np.array([(0, 1, 2), (1, 2, 3)])


def test_a_mesh_holds_its_own_arrays() -> None:
    vertices, triangles = CORNERS.astype(np.float32), TRIANGLES.astype(np.uint8)
    mesh = Mesh(vertices, triangles, normals=CORNERS)
    vertices[:], triangles[:] = 7, 3
    np.testing.assert_array_equal(mesh.vertices, CORNERS)
    np.testing.assert_array_equal(mesh.triangles, TRIANGLES)
    assert mesh.vertices.dtype == np.float64 and mesh.triangles.dtype == np.int64
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0] = 1
    with pytest.raises(FrozenInstanceError):
        mesh.opacity = 0.5  # type: ignore[misc]
    assert "4 vertices, 2 triangles" in repr(mesh) and replace(mesh, opacity=0.5).opacity == 0.5


@pytest.mark.parametrize(
    ("vertices", "triangles", "more", "words"),
    [
        ([], TRIANGLES, {}, "must have vertices, got none"),
        (np.empty((0, 3)), TRIANGLES, {}, "must have vertices, got none"),
        (CORNERS, [], {}, "must have triangles, got none"),
        (CORNERS, np.empty((0, 3), int), {}, "must have triangles, got none"),
        (CORNERS[:, :2], TRIANGLES, {}, r"vertices must have shape \(n, 3\), got \(4, 2\)"),
        (CORNERS[0], TRIANGLES, {}, r"vertices must have shape \(n, 3\), got \(3,\)"),
        (CORNERS, TRIANGLES[:, :2], {}, r"triangles must have shape \(m, 3\), got \(2, 2\)"),
        (CORNERS, [(0, 1, 2), (0, 1)], {}, r"triangles .*have shape \(m, 3\)"),
        ("no", TRIANGLES, {}, "vertices must be numbers x, y, z, got str"),
        ([(0, 0, 0), (0, 0)], TRIANGLES, {}, "vertices must be numbers"),
        ([(0, 0, 0), (1, np.nan, 0), (0, 1, 0)], [(0, 1, 2)], {}, "must be finite .* got 1, nan, 0 at number 1"),
        ([(0, 0, 0), (1, 0, 0), (np.inf, 1, 0)], [(0, 1, 2)], {}, "got inf, 1, 0 at number 2"),
        ([(0, 0, 0), (1, 0, 0), (1e101, 1, 0)], [(0, 1, 2)], {}, "at most 1e\\+100"),
        (CORNERS, [(0, 1, 2), (1, 2, 4)], {}, "triangle 1 has corner 4, but the points are 0 to 3"),
        (CORNERS, [(0, 1, -1)], {}, "triangle 0 has corner -1"),
        (CORNERS, [(0.0, 1.0, 2.0)], {}, "triangles must be whole numbers, got float64"),
        (CORNERS, TRIANGLES, {"normals": CORNERS[:3]}, "normals must be as many as vertices, 4, got 3"),
        (CORNERS, TRIANGLES, {"normals": CORNERS * np.nan}, "normals must be finite"),
        (CORNERS, TRIANGLES, {"opacity": 0}, "opacity must be above 0 and at most 1, got 0"),
        (CORNERS, TRIANGLES, {"opacity": 1.5}, "opacity must be above 0 and at most 1, got 1.5"),
        (CORNERS, TRIANGLES, {"opacity": np.nan}, "opacity"),
        (CORNERS, TRIANGLES, {"opacity": True}, "opacity"),
        (CORNERS, TRIANGLES, {"color": (1, 1)}, "color must be three numbers"),
        (CORNERS, TRIANGLES, {"color": (0, 0, 2)}, "color must be three numbers"),
        (CORNERS, TRIANGLES, {"color": (0, 0, np.nan)}, "color must be three numbers"),
        (CORNERS, TRIANGLES, {"color": "no colour"}, "color must be three numbers"),
    ],
)
def test_what_is_no_mesh_is_refused(vertices: Any, triangles: Any, more: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=f"^thing: .*{words}|^thing: {words}") as refused:
        Mesh(vertices, triangles, name="thing", **more)
    assert "\n" not in str(refused.value)


def test_lines_are_pairs_or_polylines() -> None:
    pairs = Lines(CORNERS, [(0, 1), (1, 2), (2, 3)])
    for segments in ([(0, 1, 2, 3)], [range(4)], [[0, 1], [1, 2, 3]], [np.arange(4), [2]], np.array([(0, 1, 2, 3)])):
        np.testing.assert_array_equal(Lines(CORNERS, segments).segments, pairs.segments)
    assert "4 points, 3 segments" in repr(pairs)


@pytest.mark.parametrize(
    ("points", "segments", "more", "words"),
    [
        ([], [(0, 1)], {}, "must have points, got none"),
        (CORNERS, [], {}, "must have segments, got none"),
        (CORNERS, [[2]], {}, "must have segments, got none"),
        (CORNERS, [0, 1], {}, "segments must be pairs of points, or polylines"),
        (CORNERS, 3, {}, "segments must be pairs of points, or polylines"),
        (CORNERS, [(0, 4)], {}, "segment 0 has corner 4"),
        (CORNERS, [(0, 1, 9)], {}, "segment 1 has corner 9"),
        (CORNERS, [(0, 0.5)], {}, "segments must be whole numbers"),
        (CORNERS, [(0, 1)], {"width": 0}, "width must be above 0 and at most 1000 pixels, got 0"),
        (CORNERS, [(0, 1)], {"width": 1e4}, "width"),
        (CORNERS, [(0, 1)], {"width": np.nan}, "width"),
        (CORNERS * np.inf, [(0, 1)], {}, "points must be finite"),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value")
def test_what_is_no_line_is_refused(points: Any, segments: Any, more: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=f"^thing: {words}"):
        Lines(points, segments, name="thing", **more)
