"""Unstructured grids, which texvol does not read: their formats, and a hint for the user."""

from __future__ import annotations

HINT = "resample it onto a regular grid, in ParaView by the filter Resample To Image, and save that as VTI"

KINDS = {
    ".vtu": "VTU (a VTK unstructured grid)",
    ".pvtu": "PVTU (a VTK unstructured grid in parts)",
    ".cgns": "CGNS",
    ".exo": "Exodus",
    ".ex2": "Exodus",
    ".exii": "Exodus",
    ".e": "Exodus",
    ".vtm": "VTM (VTK blocks)",
    ".vtmb": "VTM (VTK blocks)",
    ".foam": "OpenFOAM",
    ".case": "EnSight",
    ".msh": "a mesh (MSH)",
}
