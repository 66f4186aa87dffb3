"""A scene as data, checked when it is made: volume, transfer function, camera, light, cutting, geometry, modes.

Nothing here knows how a picture is drawn. The renderer and the oracle (`texvol.ray_casting`) both start from it.
"""
