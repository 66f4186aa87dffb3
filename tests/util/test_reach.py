"""Files that a window in a browser may use: those in its folders, whatever path leads to them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from texvol import TransferFunction, geometry, load
from texvol.util import reach, writing
from texvol.util.errors import InputError


@pytest.fixture
def inside(tmp_path: Path) -> Iterator[Path]:
    """The only allowed folder, with a volume; beside it are another one, and links to that."""
    for name in ("in", "in-other"):
        (tmp_path / name).mkdir()
        np.save(tmp_path / name / "a.npy", np.zeros((4, 4, 4), np.float32))
    (tmp_path / "in/link.npy").symlink_to(tmp_path / "in-other/a.npy")
    (tmp_path / "in/links").symlink_to(tmp_path / "in-other")
    (tmp_path / "in-other/points.ply").write_text("ply")
    (tmp_path / "in-other/tf.json").write_text("{}")
    (tmp_path / "own").mkdir()
    reach.limit([str(tmp_path / "in")], [str(tmp_path / "own")])
    yield tmp_path / "in"
    reach.limit(None)


def test_a_volume_is_read_from_within_only(inside: Path) -> None:
    assert load(inside / "a.npy").size == 64
    for path in ("../in-other/a.npy", "link.npy", "links/a.npy", "/etc/passwd", "../nothing.npy"):
        with pytest.raises(InputError, match=r"is outside .*in; texvol view --files FOLDER"):
            load(inside / path)
    with pytest.raises(InputError, match="is outside"):
        load("http://127.0.0.1:1/a.zarr")


def test_nothing_else_is_read_or_written_outside(inside: Path) -> None:
    other = inside.parent / "in-other"
    with pytest.raises(InputError, match="is outside"):
        geometry.load_mesh(other / "points.ply")
    with pytest.raises(InputError, match="is outside"):
        TransferFunction.load(other / "tf.json")
    for path in (other / "new", inside / "links/new", inside / "../new"):
        with pytest.raises(InputError, match="is outside"):
            writing.write_files({path: b""})
        with pytest.raises(InputError, match="is outside"):
            writing.check_writable(path)
    writing.write_files({inside / "new": b"", inside.parent / "own/new": b""})
    assert reach.folders() == (str(inside),)
    assert sorted(each.name for each in other.iterdir()) == ["a.npy", "points.ply", "tf.json"]


def test_a_url_reaches_what_is_below_it_and_nothing_above() -> None:
    reach.limit(["https://user:word@example.org/data"])
    try:
        assert reach.holds("https://user:word@example.org/data/a.zarr")
        for path in ("data/../a", "data/%2e%2e/a", "database", ""):
            assert not reach.holds(f"https://user:word@example.org/{path}")
        assert not reach.holds("https://example.com/data")
        assert not reach.holds("/data")
        with pytest.raises(InputError) as raised:
            reach.check("/etc/passwd")
        assert "word" not in str(raised.value)
    finally:
        reach.limit(None)
    assert reach.holds("/etc/passwd"), "without a limit, all"
