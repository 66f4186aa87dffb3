"""Libraries complain on stderr about bad files; texvol says it once, in its error."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import nibabel
import numpy as np
import tifffile
from support import marked
from support.dicom_files import slice_of

# Handlers are bound to stderr when a library is imported: only a process of its own shows what a user would see.
CODE = """
import sys
from texvol import TexvolError, load
for path in sys.argv[1:]:
    try:
        load(path)
    except TexvolError as error:
        print(error)
    else:
        print("read")
"""


def test_stderr_stays_empty(tmp_path: Path) -> None:
    nibabel.save(nibabel.Nifti1Image(marked.marked().T, np.eye(4)), tmp_path / "v.nii")
    content = bytearray((tmp_path / "v.nii").read_bytes())
    content[80:84] = np.float32(-2).tobytes()  # a pixdim that nibabel repairs, and logs
    content[70:72] = np.int16(3333).tobytes()  # a data type that it refuses, and logs
    (tmp_path / "v.nii").write_bytes(content)

    tifffile.imwrite(tmp_path / "v.tif", marked.marked(), photometric="minisblack", contiguous=False, metadata=None)
    content = bytearray((tmp_path / "v.tif").read_bytes())
    content[12:14] = b"\xff\xff"  # the type of the first field, which tifffile does not know, and logs
    (tmp_path / "v.tif").write_bytes(content)

    dataset = slice_of(0)
    dataset.save_as(tmp_path / "v.dcm", enforce_file_format=True)
    content = (tmp_path / "v.dcm").read_bytes().replace(b"2.5.6\0", b"2.x.6\0")  # an invalid UID: pydicom warns
    (tmp_path / "v.dcm").write_bytes(content)

    paths = [str(tmp_path / name) for name in ("v.nii", "v.tif", "v.dcm")]
    repository = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-c", CODE, *paths]
    result = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=True)
    assert result.stderr == ""
    assert len(result.stdout.splitlines()) == 3
