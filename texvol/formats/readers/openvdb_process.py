"""Reads a grid of an OpenVDB file, as a script of the Python that has OpenVDB's module; needs numpy and nothing else.

    python openvdb_process.py FILE GRID SAMPLES MOST_BYTES ADDRESS_SPACE

Writes the samples as float32 and prints a JSON object; `fault` is why it could not. Status 3: there is no such module.
"""

import json
import sys


def main() -> int:
    try:
        import pyopenvdb
    except ImportError:
        try:
            import openvdb as pyopenvdb
        except ImportError:
            return 3
    import resource

    path, name, samples, most, space = sys.argv[1:6]
    resource.setrlimit(resource.RLIMIT_AS, (int(space), int(space)))
    try:
        print(json.dumps(_read(pyopenvdb, path, name, samples, int(most))))
    except MemoryError:
        print(json.dumps({"fault": "reading it needs more memory than there is"}))
    except (ValueError, OSError) as error:
        print(json.dumps({"fault": str(error) or type(error).__name__}))
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        print(json.dumps({"fault": f"it is damaged, or not as its library expects ({reason})"}))
    return 0


def _read(vdb, path, name, samples, most):  # type: ignore[no-untyped-def]
    """Write the samples of a grid, and return where they lie."""
    name = _chosen(_numbered([grid.name for grid in vdb.readAllGridMetadata(path)]), name)
    grid = vdb.read(path, name)
    kind = type(grid).__name__
    if kind not in ("FloatGrid", "DoubleGrid", "Int32Grid", "Int64Grid", "BoolGrid", "Vec3SGrid"):
        raise ValueError(f"must be a grid of numbers or of vectors of three, got {kind}")
    low, high = grid.evalActiveVoxelBoundingBox()
    sizes = [int(b) - int(a) + 1 for a, b in zip(low, high, strict=True)]
    if min(sizes) < 1:
        raise ValueError("has no active voxel")
    origin, columns = _placed(grid.transform, low, high)
    channels = 3 if kind.startswith("Vec3") else 1
    needed = 4 * channels * sizes[0] * sizes[1] * sizes[2]
    if needed > most:
        box = " x ".join(map(str, sizes))
        raise ValueError(f"its box of {box} voxels needs {needed} bytes, and there is {most}")
    _dense(grid, low, [*sizes, 3] if channels == 3 else sizes).tofile(samples)
    notes = [f"grid {name}: voxels that are not active are {grid.background}"]
    if str(grid.gridClass).lower() == "level set":
        notes.append("it is a level set: values are distances, negative inside")
    return {"sizes": sizes, "channels": channels, "origin": origin, "columns": columns, "notes": notes}


def _numbered(names):  # type: ignore[no-untyped-def]
    """Return names by which OpenVDB finds the grids: of several grids of one name, with a number."""
    return [f"{name}[{names[:at].count(name)}]" if names.count(name) > 1 else name for at, name in enumerate(names)]


def _chosen(names, name):  # type: ignore[no-untyped-def]
    """Return the name of the grid that is asked for, or of the only one."""
    listed = ", ".join(names[:12])
    if not names:
        raise ValueError("has no grid")
    if name and name not in names:
        raise ValueError(f"has no grid {name} (--variable); it has {listed}")
    if not name and len(names) > 1:
        raise ValueError(f"has {len(names)} grids: {listed}; --variable NAME chooses one")
    return name or names[0]


def _dense(grid, low, shape):  # type: ignore[no-untyped-def]
    """Return the samples within the box of active voxels, x slowest."""
    import numpy as np

    # Truth values are copied to nothing but truth values.
    values = np.zeros(shape, bool if type(grid).__name__ == "BoolGrid" else np.float32)
    grid.copyToArray(values, ijk=low)
    return values.astype(np.float32)


def _placed(transform, low, high):  # type: ignore[no-untyped-def]
    """Return the position of the first voxel, and the steps along i, j and k; raise ValueError if these change."""
    origin = [float(each) for each in transform.indexToWorld(tuple(low))]
    columns = []
    for axis in range(3):
        step = [int(each) for each in low]
        step[axis] += 1
        columns.append([float(b) - a for a, b in zip(origin, transform.indexToWorld(tuple(step)), strict=True)])
    straight = [origin[a] + sum(columns[k][a] * (high[k] - low[k]) for k in range(3)) for a in range(3)]
    off = max(abs(a - float(b)) for a, b in zip(straight, transform.indexToWorld(tuple(high)), strict=True))
    if off > 1e-4 * max(abs(each) for column in columns for each in column):
        raise ValueError("must have a linear transform, got one with perspective")
    return origin, columns


if __name__ == "__main__":
    sys.exit(main())
