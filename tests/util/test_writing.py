"""Files come whole, under no name that anybody else knows before, and with the permissions of any new file."""

from __future__ import annotations

import os
import resource
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from texvol import geometry
from texvol.formats.films import film
from texvol.formats.pictures import depth as depth_picture
from texvol.formats.pictures import image
from texvol.util import writing
from texvol.util.errors import InputError

PICTURE = np.random.default_rng(3).random((32, 32, 4)).astype(np.float32)


def written(path: Path) -> None:
    """Write something of the kind that the name says."""
    if path.suffix in (".mp4", ".gif") or "%" in path.name:
        if path.suffix in (".mp4", ".gif"):
            pytest.importorskip("imageio_ffmpeg", reason="films need the extra: pip install '.[film]'")
        with film.Writer(path, (32, 32), 3) as writer:
            for _ in range(3):
                writer.add(PICTURE)
            writer.finish()
    elif path.name == "depth.exr":
        depth_picture.write(path, PICTURE[..., 0])
    elif path.suffix == ".obj":
        geometry.save_mesh(geometry.Mesh(np.eye(3), [[0, 1, 2]]), path)
    else:
        image.write(path, PICTURE)


NAMES = ("a.png", "a.exr", "a.jpg", "depth.exr", "a.obj", "frame_%d.png", "a.mp4", "a.gif")


@pytest.mark.parametrize("name", NAMES)
def test_nobody_can_know_where_a_file_is_written_before_it_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Every name is in a folder of which two are never the same, and that is its owner's alone."""
    folders: list[Path] = []
    named, make = writing.folder_beside, writing.make

    def seen(path: Path) -> Path:
        folders.append(named(path))
        assert folders[-1].parent == tmp_path and not folders[-1].exists()
        return folders[-1]

    def made(folder: Path) -> None:
        make(folder)
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700

    monkeypatch.setattr(writing, "folder_beside", seen)
    monkeypatch.setattr(writing, "make", made)
    written(tmp_path / name)
    written(tmp_path / name)
    if "%" not in name:  # whose folders are named in other processes
        assert len({each.name for each in folders}) == 2
    assert not any(each.name.startswith(".") for each in tmp_path.iterdir())


@pytest.mark.parametrize("name", NAMES)
def test_a_planted_link_is_not_followed(tmp_path: Path, name: str) -> None:
    """Links under names that can be counted: this process's and its children's numbers, and the next numbers."""
    victim = tmp_path / "victim"
    victim.write_text("mine")
    folder = tmp_path / "shared"
    folder.mkdir()
    planted = [f".texvol-{os.getpid()}-{number}" for number in range(200)]
    for each in planted:
        (folder / each).symlink_to(victim)
    written(folder / name)
    assert victim.read_text() == "mine"
    assert all((folder / each).is_symlink() for each in planted)


@pytest.mark.parametrize("name", ["a.png", "a.mp4"])
@pytest.mark.parametrize("target", ["theirs", "nowhere"])
def test_what_stands_where_the_folder_goes_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, target: str
) -> None:
    """Even where its name is known a folder is made new, and no link is followed."""
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "file").write_text("mine")
    (tmp_path / "theirs" / "film").write_text("mine")
    (tmp_path / "known").symlink_to(tmp_path / target)
    monkeypatch.setattr(writing, "folder_beside", lambda path: tmp_path / "known")
    with pytest.raises(InputError, match=f"{name}: cannot be written: File exists"):
        written(tmp_path / name)
    assert {each.read_text() for each in (tmp_path / "theirs").iterdir()} == {"mine"}


def test_a_file_is_made_new_and_no_link_followed(tmp_path: Path) -> None:
    (tmp_path / "victim").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "victim")
    with pytest.raises(FileExistsError):
        writing._written(tmp_path / "link", b"theirs")
    assert (tmp_path / "victim").read_text() == "mine"


@pytest.mark.parametrize(
    "name, mask, mode",
    [*((name, 0o022, 0o644) for name in NAMES), ("a.png", 0o077, 0o600), ("a.mp4", 0o077, 0o600)]
    + [("a.obj", 0o002, 0o664), ("frame_%d.png", 0o002, 0o664)],
)
def test_permissions_are_those_of_a_new_file(tmp_path: Path, name: str, mask: int, mode: int) -> None:
    before = os.umask(mask)
    try:
        written(tmp_path / name)
    finally:
        os.umask(before)
    assert {stat.S_IMODE(each.stat().st_mode) for each in tmp_path.iterdir()} == {mode}


def test_what_a_link_of_ones_own_points_to_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "link.png").symlink_to(tmp_path / "kept.png")
    written(tmp_path / "link.png")
    assert (tmp_path / "link.png").is_symlink()
    assert image.read(tmp_path / "kept.png").shape == (32, 32, 3)


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.mark.parametrize("name", NAMES)
def test_a_limit_on_the_size_of_files_is_what_the_error_names(tmp_path: Path, name: str) -> None:
    with files_of_at_most(40), pytest.raises(InputError) as caught:
        written(tmp_path / name)
    message = str(caught.value)
    reason = "File too large: the limit (ulimit -f) is 40 bytes"
    assert message.startswith(f"{tmp_path / name}: cannot be written: {reason}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name, most", [("a.mp4", 140_000), ("a.gif", 140_000)])
def test_a_film_that_outgrows_the_limit_midway_leaves_nothing(tmp_path: Path, name: str, most: int) -> None:
    """There is room for the pictures on their way, and not for the film."""
    pytest.importorskip("imageio_ffmpeg", reason="films need the extra: pip install '.[film]'")
    noise = np.random.default_rng(1)
    with (
        files_of_at_most(most),
        pytest.raises(InputError) as caught,
        film.Writer(tmp_path / name, (64, 64), 99) as film_,
    ):
        for _ in range(99):
            film_.add(noise.random((64, 64, 4)).astype(np.float32))
        film_.finish()
    assert "cannot be written" in str(caught.value)
    assert "File too large" in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_an_orbit_under_a_limit_ends_with_one_true_line(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg", reason="films need the extra: pip install '.[film]'")
    np.save(tmp_path / "v.npy", np.zeros((4, 4, 4), np.float32))
    line = [sys.executable, "-m", "texvol", "render", "v.npy", "--size", "16x16", "--orbit", "3", "-o", "a.mp4"]
    with files_of_at_most(1024):
        done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == (
        "texvol: error: a.mp4: cannot be written: File too large: the limit (ulimit -f) is 1024 bytes; "
        "a scratch file of 8192 bytes is needed\n"
    )
    assert os.listdir(tmp_path) == ["v.npy"]


@pytest.mark.parametrize(
    "name, reason",
    [
        ("pipe.png", "must be a regular file, got a device or the like"),
        ("folder.png", "must be a file, got a folder"),
        ("no/a.png", "its folder {folder}/no does not exist"),
    ],
)
def test_where_nothing_can_be_written_is_said(tmp_path: Path, name: str, reason: str) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError) as caught:
        writing.check_writable(tmp_path / name)
    assert str(caught.value) == f"{tmp_path / name}: {reason.format(folder=tmp_path)}"


@pytest.mark.parametrize("name", ["a\0b.png", "a\ud800.png"])
def test_a_name_that_no_file_can_have_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="not a valid file name"):
        image.write(name, PICTURE)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a link to somebody else")
def test_a_link_of_somebody_else_in_everybodys_folder_is_not_followed(tmp_path: Path) -> None:
    """As the kernel has it (fs.protected_symlinks), whose rule a file that is renamed would get round."""
    shared, victim = tmp_path / "shared", tmp_path / "victim.png"
    shared.mkdir()
    shared.chmod(0o1777)
    os.chown(shared, 1234, -1)
    victim.write_text("mine")
    for owner, is_followed in ((4321, False), (0, True), (1234, True)):
        link = shared / f"{owner}.png"
        link.symlink_to(victim)
        os.lchown(link, owner, -1)
        if is_followed:
            written(link)
            assert victim.read_bytes().startswith(b"\x89PNG")
        else:
            with pytest.raises(InputError, match="another user's link"):
                written(link)
            assert victim.read_text() == "mine"


def test_a_folder_that_can_not_be_written_to_is_named_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write everywhere
    with pytest.raises(InputError, match=f"^a.png: its folder {tmp_path} cannot be written to$"):
        writing.check_writable("a.png")
