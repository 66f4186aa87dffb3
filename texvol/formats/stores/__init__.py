"""Readers of stores whose samples stay there until they are asked for: OME-Zarr, Zarr, HDF5, Imaris, arrays."""
