"""Writer of OME-Zarr: a volume of any size, shard by shard, with its pyramid and the statistics of its chunks."""
