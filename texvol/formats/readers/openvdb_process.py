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
    except Exception as error:
        print(json.dumps({"fault": str(error) or type(error).__name__}))
    return 0


def _read(vdb, path, name, samples, most):  # type: ignore[no-untyped-def]
    import numpy as np

    grids = vdb.readAllGridMetadata(path)
    names = [grid.name for grid in grids]
    if not names:
        return {"fault": "has no grid"}
    if name and name not in names:
        return {"fault": f"has no grid {name} (--variable); it has {', '.join(names[:12])}"}
    if not name and len(names) > 1:
        return {"fault": f"has {len(names)} grids: {', '.join(names[:12])}; --variable NAME chooses one"}
    grid = vdb.read(path, name or names[0])
    kind = type(grid).__name__
    if kind not in ("FloatGrid", "DoubleGrid", "Int32Grid", "Int64Grid", "BoolGrid", "Vec3SGrid"):
        return {"fault": f"must be a grid of numbers or of vectors of three, got {kind}"}
    low, high = grid.evalActiveVoxelBoundingBox()
    sizes = [int(b) - int(a) + 1 for a, b in zip(low, high, strict=True)]
    channels = 3 if kind.startswith("Vec3") else 1
    if min(sizes) < 1:
        return {"fault": "has no active voxel"}
    needed = 4 * channels * sizes[0] * sizes[1] * sizes[2]
    if needed > most:
        return {
            "fault": f"its box of {sizes[0]} x {sizes[1]} x {sizes[2]} voxels needs {needed} bytes, and there is {most}"
        }
    values = np.zeros([*sizes, 3] if channels == 3 else sizes, np.float32)
    if kind == "BoolGrid":
        marks = np.zeros(sizes, bool)
        grid.copyToArray(marks, ijk=low)
        values[...] = marks
    else:
        grid.copyToArray(values, ijk=low)
    values.tofile(samples)
    origin = [float(each) for each in grid.transform.indexToWorld(tuple(low))]
    columns = []
    for axis in range(3):
        step = [int(each) for each in low]
        step[axis] += 1
        columns.append([float(b) - a for a, b in zip(origin, grid.transform.indexToWorld(tuple(step)), strict=True)])
    far = [float(each) for each in grid.transform.indexToWorld(tuple(high))]
    straight = [origin[a] + sum(columns[k][a] * (sizes[k] - 1) for k in range(3)) for a in range(3)]
    off = max(abs(a - b) for a, b in zip(far, straight, strict=True))
    if off > 1e-4 * max(abs(each) for column in columns for each in column):
        return {"fault": "must have a linear transform, got one with perspective"}
    notes = [f"grid {name or names[0]}: voxels that are not active are {grid.background}"]
    if str(grid.gridClass).lower() == "level set":
        notes.append("it is a level set: values are distances, negative inside")
    return {"sizes": sizes, "channels": channels, "origin": origin, "columns": columns, "notes": notes}


if __name__ == "__main__":
    sys.exit(main())
