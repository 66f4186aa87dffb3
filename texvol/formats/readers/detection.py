"""Format of a file by its name, confirmed by its first bytes; a contradiction is an error."""

from __future__ import annotations

import os
import re
import stat
import zlib

from texvol.formats.readers import hdf5_files
from texvol.formats.readers.magnitude import MAGNITUDE
from texvol.formats.readers.samples import Choice, FileFault
from texvol.util import reach
from texvol.util.locations import is_remote

_PACKED = ("", ".gz", ".bz2")
FORMATS = {
    "NRRD": (".nrrd", ".nhdr"),
    "NIfTI": (".nii", ".nii.gz", ".hdr", ".img", ".hdr.gz", ".img.gz"),
    "MetaImage": (".mha", ".mhd"),
    "DICOM": (".dcm", ".dicom", ".ima"),
    "TIFF": (".tif", ".tiff"),
    "GIPL": (".gipl", ".gipl.gz"),
    "MGH": (".mgh", ".mgz", ".mgh.gz"),
    "AFNI": (".head", ".brik", ".brik.gz", ".brik.bz2"),
    "MINC": (".mnc",),
    "CZI": (".czi",),
    "ND2": (".nd2",),
    "LIF": (".lif",),
    "SEG-Y": (".sgy", ".segy"),
    "FITS": (".fits", ".fit", ".fts", ".fits.gz", ".fits.fz"),
    "OpenVDB": (".vdb",),
    "MRC": tuple(f".{ending}{packed}" for ending in ("mrc", "map", "rec", "ccp4", "mrcs", "ali") for packed in _PACKED),
    "VTI": (".vti",),
    "VTR": (".vtr",),
    "VTS": (".vts",),
    "VTU": (".vtu", ".pvtu"),
    "netCDF": (".nc", ".nc4", ".cdf"),
    "Exodus": (".e", ".exo", ".ex2", ".exii"),
    "VTK": (".vtk",),
    "Gmsh": (".msh",),
    "XDMF": (".xdmf", ".xmf"),
    "MED": (".med",),
    "NPY": (".npy",),
    "Zarr": (".zarr",),
    "HDF5": (".h5", ".hdf5", ".hdf", ".he5"),
    "Imaris": (".ims",),
    "raw": tuple(f".{ending}{packed}" for ending in ("raw", "bin", "dat") for packed in _PACKED),
}
READ = ", ".join(FORMATS)
# Modules that are not named like the format.
_READERS = dict.fromkeys(("VTK", "Gmsh", "XDMF", "MED"), "meshes") | {"SEG-Y": "segy"}
_EXTRAS = dict.fromkeys(("CZI", "ND2", "LIF"), "microscopy") | {"SEG-Y": "seismic", "FITS": "astronomy"}
_IN_HDF5 = ("HDF5", "Imaris", "netCDF", "Exodus", "MED", "MINC")  # which name other files
STORES = ("Zarr", "HDF5", "Imaris")  # whose samples stay where they are until they are asked for

TO_IMAGE = "resample it onto a regular grid, in ParaView by the filter Resample To Image, and save that as VTI"
_SAVE = "save it as VTI, VTR or VTS, in ParaView by File, Save Data"
_OTHERS = f"texvol reads {READ}"

# Kinds of files that texvol does not read, their endings, and a hint for the user.
_REFUSED = (
    ("CGNS", (".cgns",), TO_IMAGE),
    ("an Abaqus mesh, which holds no field", (".inp",), TO_IMAGE),
    ("a Medit mesh, which holds no field", (".mesh", ".meshb"), TO_IMAGE),
    ("VTM (VTK blocks)", (".vtm", ".vtmb"), TO_IMAGE),
    ("OpenFOAM", (".foam",), TO_IMAGE),
    ("EnSight", (".case",), TO_IMAGE),
    ("PVTI (a VTK grid in parts)", (".pvti",), _SAVE),
    ("PVTR (a VTK grid in parts)", (".pvtr",), _SAVE),
    ("PVTS (a VTK grid in parts)", (".pvts",), _SAVE),
    ("VTP (VTK polygons)", (".vtp",), _OTHERS),
    ("NPZ", (".npz",), _OTHERS),
    ("PNG", (".png",), _OTHERS),
    ("JPEG", (".jpg", ".jpeg"), _OTHERS),
    ("OpenEXR", (".exr",), _OTHERS),
    ("ZIP", (".zip",), _OTHERS),
)
# Types of VTK's XML files.
_READ_XML = {"ImageData": "VTI", "RectilinearGrid": "VTR", "StructuredGrid": "VTS"}
_READ_XML |= {"UnstructuredGrid": "VTU", "PUnstructuredGrid": "VTU"}
_UNREAD_XML = {"PolyData": "VTP (VTK polygons)"}
_HDF5, _ANALYZE = "HDF5", "Analyze"
_UNKNOWN = "of no known kind"

# Formats with several variables, and those whose grid may need resampling.
UNSTRUCTURED = ("VTU", "Exodus", "VTK", "Gmsh", "XDMF", "MED")
_WITH_VARIABLES = ("netCDF", "VTI", "VTR", "VTS", "Zarr", "HDF5", "FITS", "OpenVDB", *UNSTRUCTURED)
_WITH_IMAGES = ("Zarr", "CZI", "ND2", "LIF")
RESAMPLED = ("netCDF", "VTR", "VTS", *UNSTRUCTURED)
_WITH_COLORS = ("NRRD", "NIfTI", "MetaImage", "DICOM", "TIFF", "VTI", "NPY")

# Offset, bytes and format of each magic number.
_MAGIC = (
    (128, b"DICM", "DICOM"),  # after 128 bytes of any content, such as TIFF's
    (0, b"\x93NUMPY", "NPY"),
    (0, b"NRRD", "NRRD"),
    (0, b"II*\0", "TIFF"),
    (0, b"MM\0*", "TIFF"),
    (0, b"II+\0", "TIFF"),
    (0, b"MM\0+", "TIFF"),
    (344, b"n+1\0", "NIfTI"),
    (344, b"ni1\0", "NIfTI"),
    (4, b"n+2\0\r\n\x1a\n", "NIfTI"),
    (4, b"ni2\0\r\n\x1a\n", "NIfTI"),
    (0, b"\x5c\x01\0\0", _ANALYZE),
    (0, b"\0\0\x01\x5c", _ANALYZE),
    (252, b"\x2a\xe3\x89\xb8", "GIPL"),
    (252, b"\xef\xff\xe9\xb0", "GIPL"),
    (208, b"MAP ", "MRC"),
    (208, b"MAP\0", "MRC"),
    (0, b"\x1f\x8b", "gzip"),
    (0, b"BZh", "bzip2"),
    (0, b"PK\x03\x04", "ZIP"),
    (0, b"\x89HDF\r\n\x1a\n", _HDF5),
    (0, b"CDF\x01", "netCDF"),
    (0, b"CDF\x02", "netCDF"),
    (0, b"CDF\x05", "netCDF"),
    (0, b"\x89PNG", "PNG"),
    (0, b"\xff\xd8\xff", "JPEG"),
    (0, b"\x76\x2f\x31\x01", "OpenEXR"),
    (0, b"%PDF", "PDF"),
    (0, b"ZISRAWFILE", "CZI"),
    (0, b"\xda\xce\xbe\x0a", "ND2"),
    (0, b"SIMPLE  =", "FITS"),
    (0, b" BDV\0\0\0\0", "OpenVDB"),
    (0, b"# vtk DataFile", "VTK"),
    (0, b"$MeshFormat", "Gmsh"),
)
# Formats whose files are of another kind at their beginning.
_CONTAINERS = {"netCDF": (_HDF5,), "Exodus": (_HDF5, "netCDF"), "MED": (_HDF5,), "Imaris": (_HDF5,)}
_CONTAINERS |= {"MINC": (_HDF5, "netCDF"), "NIfTI": (_ANALYZE,)}


def located(path: str, choice: Choice) -> tuple[str, Choice]:
    """Return the file and the choice of FILE::NAME, which is FILE with --variable NAME."""
    if "::" not in path or is_remote(path) or os.path.exists(path):
        return path, choice
    head, _, name = path.partition("::")
    while name and not os.path.isfile(head):  # a name of a file may have colons, too
        more, separator, name = name.partition("::")
        head = f"{head}::{more}"
        if not separator:
            return path, choice
    if not name:
        return path, choice
    if choice.variable not in (None, name):
        raise FileFault(f"names the variable {name}, and --variable another, {choice.variable}: give one of them")
    return head, choice._replace(variable=name)


def reader_of(kind: str) -> str:
    """Return the name of the module that reads a format, a key of FORMATS."""
    package = "texvol.formats.stores" if kind in STORES else "texvol.formats.readers"
    return f"{package}.{_READERS.get(kind, kind.lower())}"


def extra_of(kind: str) -> str:
    """Return the extra that has the library of a format."""
    return "zarr" if kind in STORES else _EXTRAS.get(kind, "formats")


def format_of(path: str, choice: Choice) -> str:
    """Return the key of FORMATS for a file or folder.

    Raises
    ------
    FileFault
        If it does not exist, is empty, is not read by texvol, or contradicts its name.
    InputError
        If it is out of reach, see `texvol.util.reach`.
    """
    reach.check(path)
    found = "Zarr" if is_remote(path) else _format_here(path, choice)
    _check_choice(found, choice)
    if found in _IN_HDF5:
        hdf5_files.check(path)
    return found


def _format_here(path: str, choice: Choice) -> str:
    try:
        status = os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        raise FileFault("no such file") from None
    if stat.S_ISDIR(status.st_mode):
        return _format_of_folder(path)
    if not stat.S_ISREG(status.st_mode):
        raise FileFault("is not a regular file")
    if status.st_size == 0:
        raise FileFault("is empty")
    return _format_of_file(path, choice)


def _check_choice(found: str, choice: Choice) -> None:
    """Raise FileFault if an option is not for the format."""
    if found != "raw" and (choice.shape is not None or choice.dtype is not None):
        raise FileFault(f"is {found}, which has its own shape and type: --shape and --dtype are for raw files")
    if found != "DICOM" and choice.series is not None:
        raise FileFault(f"is {found}: --series is for the DICOM series of a folder")
    if found not in _WITH_VARIABLES and choice.variable is not None:
        raise FileFault(f"is {found}: --variable is for the variables of {', '.join(_WITH_VARIABLES)}")
    if found != "DICOM" and choice.resample:
        raise FileFault(f"is {found}: --resample is for slices of DICOM")
    if found not in RESAMPLED and choice.resolution is not None and not choice.resample:
        names = ", ".join(RESAMPLED)
        raise FileFault(f"is {found}, whose samples are on a regular grid: --resolution is for the grids of {names}")
    if found not in _WITH_COLORS and choice.color:
        raise FileFault(f"is {found}: --color is for the components of {', '.join(_WITH_COLORS)}")
    if choice.image is not None and found not in _WITH_IMAGES:
        raise FileFault(f"is {found}: --image is for the images of {', '.join(_WITH_IMAGES)}")
    told = {"--level": choice.level is not None}
    told |= {"--fix-pyramid": choice.fix_pyramid, "--missing-chunks": choice.missing_chunks}
    for option, is_told in told.items():
        if is_told and found not in STORES:
            raise FileFault(f"is {found}: {option} is for stores of chunks ({', '.join(STORES)})")
    if found in STORES and choice.channel == MAGNITUDE:
        raise FileFault(f"is {found}, whose channels are no components of vectors: --channel N reads one of them")


def _format_of_file(path: str, choice: Choice) -> str:
    lower = os.path.basename(path).lower()
    named = next((kind for kind, endings in FORMATS.items() if lower.endswith(endings)), None)
    if named == "raw":
        return named
    with open(path, "rb") as file:
        head = file.read(4096)
    content = content_of(head)
    if named is not None:
        _check_name(lower, named, content, head)
        return named
    for kind, endings, hint in _REFUSED:
        if lower.endswith(endings):
            raise FileFault(f"is {kind}, which texvol does not read; {hint}")
    if content in _UNREAD_XML.values():
        raise FileFault(f"is {content}, which texvol does not read; {TO_IMAGE}")
    if content in FORMATS:
        return content
    if choice.shape is None or choice.dtype is None:
        raise FileFault(f"has an unknown format (its content is {content}); {_OTHERS}")
    return "raw"


def _check_name(lower: str, named: str, content: str, head: bytes) -> None:
    """Raise FileFault if the content contradicts the format of the name."""
    packing = {".gz": "gzip", ".bz2": "bzip2"}.get(os.path.splitext(lower)[1], "")
    if packing:
        if content != packing:
            raise FileFault(f"named {packing}-compressed {named}, but its content is {content}")
        content = content_of(_unpacked_head(head)) if packing == "gzip" else named
    # An .img has the samples of a NIfTI pair and no magic number; old DICOM has no preamble, and old MRC no "MAP".
    unmarked = (
        content in _CONTAINERS.get(named, ())
        or lower.endswith((".img", ".img.gz"))
        or (named in ("DICOM", "MRC", "LIF") and content == _UNKNOWN)
        or named in ("AFNI", "SEG-Y", "MGH")  # text, and samples without a mark
    )
    if content != named and not unmarked:
        inside = f", and its unpacked content is {content}" if packing else f", but its content is {content}"
        raise FileFault(f"named {named}{inside}")


def content_of(head: bytes) -> str:
    """Return the format of a file's first bytes: a key of FORMATS, or a description."""
    for offset, magic, kind in _MAGIC:
        if head[offset : offset + len(magic)] == magic:
            return kind
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    if text.startswith((b"<?xml", b"<VTKFile", b"<Xdmf", b"<!--")):
        if b"<VTKFile" not in head and b"<Xdmf" in head:
            return "XDMF"
        start = head.find(b"<VTKFile")
        opening = head[start : head.find(b">", start)] if start >= 0 else b""
        found = re.search(rb"type\s*=\s*[\"'](\w*)[\"']", opening)
        kind = found.group(1).decode("ascii", "replace") if found else ""
        return (_READ_XML | _UNREAD_XML).get(kind, "VTK XML of another kind") if opening else "XML"
    key = text.split(b"\n", 1)[0].partition(b"=")[0].strip()
    if key in (b"ObjectType", b"NDims", b"Comment", b"ObjectSubType", b"Name", b"ID"):
        return "MetaImage"
    if head and all(byte >= 32 or byte in b"\t\r\n\f" for byte in head):
        return "text"
    return _UNKNOWN


def _unpacked_head(head: bytes) -> bytes:
    try:
        return zlib.decompressobj(zlib.MAX_WBITS | 32).decompress(head, 4096)
    except zlib.error:
        raise FileFault("its gzip data are corrupt") from None


def _format_of_folder(path: str) -> str:
    """Return Zarr, DICOM or TIFF, by the files of a folder."""
    names = sorted(os.listdir(path))
    for name in names:
        reach.check(os.path.join(path, name))  # it may be a link
    if path.rstrip("/").lower().endswith(".zarr") or {".zgroup", ".zarray", "zarr.json", ".zattrs"} & set(names):
        return "Zarr"
    files = [name for name in names if not name.startswith(".") and os.path.isfile(os.path.join(path, name))]
    if not files:
        raise FileFault("is a folder without files; it must hold DICOM or TIFF slices")
    slices = {"DICOM": 0, "TIFF": 0}
    for name in files:
        if name.lower().endswith(FORMATS["TIFF"]):
            slices["TIFF"] += 1
        elif name.lower().endswith(FORMATS["DICOM"]) or has_preamble(os.path.join(path, name)):
            slices["DICOM"] += 1
    if slices["DICOM"] and slices["TIFF"]:
        raise FileFault(f"must hold DICOM or TIFF files, got {slices['DICOM']} DICOM and {slices['TIFF']} TIFF files")
    if not any(slices.values()):
        raise FileFault(f"is a folder without a DICOM or TIFF slice among its {len(files)} files")
    return "DICOM" if slices["DICOM"] else "TIFF"


def has_preamble(path: str) -> bool:
    """True if a file has the mark of DICOM, after 128 bytes of any content."""
    with open(path, "rb") as file:
        return file.read(132)[128:] == b"DICM"
