"""Extraction of isosurfaces by the methods of the survey's chapter 4, a file each.

    marching-cubes        Lorensen and Cline 1987, with Lewiner's cases (2003)
    marching-tetrahedra   Shirley and Tuchman 1990
    cuberille             Herman and Liu 1979
    dividing-cubes        Cline, Lorensen, Ludke, Crawford and Teeter 1988: points
    contours              Keppel 1975; Fuchs, Kedem and Uselton 1977

Each takes a `field.Field` and returns `field.Facets`, but for `dividing_cubes`, which returns points and normals.
`extraction.surface_of` brings them into the world.
"""
