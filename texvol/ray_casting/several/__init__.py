"""Ray casting of several volumes that overlap, and of masks, labels and colours of samples.

Emission and extinction of all volumes add up. `tracer` walks from one face of any grid to the next; between two faces a
ray lies in at most one cell of each volume. `cells` adds the volumes up there, with the integrals of `lit`; `arrays`
holds any number of scenes of one volume in arrays of fixed number, and `workspace` the scratch memory.
"""
