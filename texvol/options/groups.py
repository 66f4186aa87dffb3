"""Scene options in groups, in the order of --help."""

from __future__ import annotations

from texvol.annotation import PARTS
from texvol.options import files, measures, texts
from texvol.options import light as lit
from texvol.options.scene_option import SceneOption
from texvol.options.volumes import ADD, LOOK, OF_ADDED, POSITION, OfAdded
from texvol.scene.framing import VIEWS
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CLASSIFICATION_CHOICES, COLORINGS, MODES


def _parts(text: str) -> tuple[str, ...]:
    """Return names of annotation parts from "PART,PART"."""
    names = tuple(each.strip() for each in text.split(",") if each.strip())
    for name in names:
        texts.Choice(*PARTS)(name)
    return names


# Title, description and options of each group.
GROUPS: tuple[tuple[str, str | None, tuple[SceneOption | OfAdded, ...]], ...] = (
    (
        "scene",
        "What is drawn. All options of this and the next seven groups may also be keys of the scene file; the command "
        "line overrides the file.",
        (
            *LOOK,
            SceneOption(
                "classification", texts.Choice(*CLASSIFICATION_CHOICES), "KIND",
                "slab, extinction, post, integrated or auto (default): slab where its whole error is at most 1/255 rms "
                "or twice that of post, and it is no dearer; else post",
            ),
            *POSITION,
            SceneOption(
                "space", texts.space, "NAME",
                "directions of the world's axes, such as left-posterior-superior, into which the volume is turned; its "
                "file must name its own",
            ),
            SceneOption("size", texts.size, "WxH", "pixels (512x512); one number is a square"),
            SceneOption(
                "background", texts.color, "COLOR",
                "linear light from behind (0,0,0), a name such as white, #RRGGBB, or: transparent",
            ),
            SceneOption(
                "gradient", lit.gradient, "KIND",
                "central (default), zucker-hummel, adaptive, which chooses between these by the local variance, or "
                "gaussian[:SCALE], which smooths over SCALE samples (1); computed only where light, contours or an "
                "isosurface need it",
            ),
        ),
    ),
    (
        "further volumes",
        "Where volumes overlap, their extinctions add up, and so do their emissions. Each --add begins a volume, and "
        "the --add-… options after it apply to that volume. In a scene file each volume is a table [[add]] with file "
        "and these names without add-.",
        (ADD, *OF_ADDED),
    ),
    (
        "camera",
        None,
        (
            SceneOption(
                "projection", texts.Choice("orthographic", "perspective"), "KIND",
                "orthographic (default) or perspective",
            ),
            SceneOption(
                "eye", texts.triple, "X,Y,Z", "position of the camera, world units (far enough to see the whole volume)"
            ),
            SceneOption("target", texts.triple, "X,Y,Z", "point that the camera looks at (the middle of the box)"),
            SceneOption("up", texts.triple, "X,Y,Z", "direction that points up in the picture (0,0,1)"),
            SceneOption("fov", texts.number, "DEGREES", "angle from bottom to top, perspective (40)"),
            SceneOption("height", texts.number, "H", "world units from bottom to top, orthographic (what shows)"),
            SceneOption(
                "view", texts.Choice(*VIEWS), "SIDE",
                f"side that is seen: {', '.join(VIEWS)}; of the body where the file knows it, else front is "
                "at lower y, right at higher x, top at higher z (front, a little from one side and from above)",
            ),
            SceneOption("azimuth", texts.number, "DEGREES", "turn of --view, or of the front, towards the right side"),
            SceneOption("elevation", texts.number, "DEGREES", "rise of the eye above that of --view, or of the front"),
            SceneOption("zoom", texts.zoom, "FACTOR", "everything so many times as large, about the middle (1)"),
            SceneOption(
                "fit", texts.Choice("content", "box"), "WHAT",
                "what fills the picture where no --eye, --target or --height says it: content (default), 99 %% of what "
                "shows, in nine tenths of the picture; or box, all of the volume",
            ),
        ),
    ),
    (
        "light",
        "Without --light a preset, and the look without --tf, have a head light that keeps highlights; a file of --tf "
        "has the light that it holds, or none. An isosurface has a head light, and so has a medium with any of "
        "--ambient, --diffuse, --specular, --shininess, --two-sided, --fade and --shadows.",
        (
            SceneOption(
                "light", lit.light, "SPEC",
                "head; directional:X,Y,Z or X,Y,Z, direction towards the light; point:X,Y,Z, position of the light; "
                "each may end with a colour :R,G,B or :I, and a point light then with :K, the distance at which it has "
                "half of its strength. Repeat it for more lights. three-point, studio: sets of lights with an "
                "exposure of their own, placed by the first view. ambient: only light from everywhere, of --ambient; "
                "depth: no light, but shading by depth; none: no light",
                lit.light_table,
            ),
            SceneOption("ambient", lit.fraction, "A", f"light from everywhere ({Lighting.ambient:g})"),
            SceneOption("diffuse", lit.fraction, "D", f"fraction of light scattered ({Lighting.diffuse:g})"),
            SceneOption("specular", lit.fraction, "S", f"fraction of light in highlights ({Lighting.specular:g})"),
            SceneOption(
                "shininess", lit.fraction, "N", f"exponent: higher is smaller highlights ({Lighting.shininess:g})"
            ),
            SceneOption(
                "two-sided", bool, "", "light the side that faces the eye (default), or only the side of lower values"
            ),
            SceneOption(
                "fade", lit.fraction, "G",
                "gradient magnitude, data units per world unit, under which shading fades out "
                "(a hundredth of the range of values per sample)",
            ),
            SceneOption("shadows", bool, "", "the medium casts shadows (default: no)"),
            SceneOption(
                "depth-cue", lit.depth_cue, "S[,R,G,B][:NEAR,FAR]",
                "mix with a colour (black) by depth: the farthest corner by S, from 0 to 1; or not at all up to depth "
                "NEAR, and by S from depth FAR on, world units from the eye (either may be left out)",
                from_value=lit.depth_cue_value,
            ),
        ),
    ),
    (
        "cutting",
        "Only the part of the volume inside all of these is visible.",
        (
            SceneOption(
                "clip", texts.clip_plane, "NX,NY,NZ,D",
                "keep points with NX x + NY y + NZ z >= D, world units; repeat it for more planes",
                texts.clip_plane_table,
            ),
            SceneOption("crop", texts.crop_box, "X0,X1,Y0,Y1,Z0,Z1", "keep this box, world units"),
            SceneOption(
                "caps", bool, "", "cut faces of the medium are opaque, in its own colour (default: no)"
            ),
        ),
    ),
    (
        "geometry",
        None,
        (
            SceneOption(
                "mesh", files.mesh, "FILE[:R,G,B][:A]",
                "surface in the volume, PLY, STL, OBJ or VTP, world units; with a linear colour and an opacity that "
                "replace those of the file; repeat it for more meshes",
                files.mesh_table,
            ),
            SceneOption(
                "depth-in", files.DepthChoice, "FILE.exr",
                "depths of another renderer's picture of the same view, as of --depth, channel Z: what lies behind is "
                "left out",
            ),
        ),
    ),
    (
        "annotation",
        "Drawn into PNG, JPEG and films, never into the data of an EXR.",
        (
            SceneOption("annotate", _parts, "PART,PART", f"parts of the annotation: {', '.join(PARTS)}"),
            SceneOption("title", str, "TEXT", "one line on top"),
            SceneOption("value-name", str, "TEXT", "name of the values in the legend, such as HU"),
            SceneOption("font", str, "FILE", "TrueType font, for characters that DejaVu Sans lacks"),
            SceneOption(
                "measure", measures.measure, "KIND POINTS[:NAME]",
                "'ruler X,Y,Z X,Y,Z', 'angle X,Y,Z X,Y,Z X,Y,Z' (at the second point), 'box X,Y,Z X,Y,Z' (two opposite "
                "corners) or 'profile[:SAMPLES] X,Y,Z X,Y,Z', world units, with a name after a colon; drawn with its "
                "value; repeat it for more measures; texvol measure prints all values",
                measures.measure_table,
            ),
        ),
    ),
    (
        "projection mode",
        None,
        (
            SceneOption(
                "mode", texts.Choice(*MODES), "MODE",
                "composite (default): emission and absorption; xray, mip, minip, average: the value's integral, "
                "maximum, minimum or average along each ray; isosurface: the first surface of --isovalue",
            ),
            SceneOption(
                "isovalue", lit.isosurface, "V[:R,G,B][:A]",
                "value of the isosurface, data units; with a linear colour and an opacity; repeat it for more surfaces",
                lit.isosurface_table, lit.isosurfaces_value,
            ),
            SceneOption(
                "air", texts.air, "V|hounsfield|none",
                "zero of xray: V integrates values minus V; hounsfield: attenuation relative to water, max(0, 1 + HU / "
                "1000); none: the values themselves. Default of 8-bit pictures: hounsfield if the data are Hounsfield "
                "units (see texvol info), else the least value; default of EXR: none",
            ),
            SceneOption(
                "window", lit.window, "CENTRE,WIDTH",
                "numbers from black to white in 8-bit pictures of xray, mip, minip and average",
            ),
            SceneOption(
                "coloring", texts.Choice(*COLORINGS), "HOW",
                "colours of 8-bit pictures of xray, mip, minip and average: grey (default), or tf, the colours of the "
                "transfer function (default if --tf is given and --window is not)",
            ),
        ),
    ),
)  # fmt: skip
SCENE_OPTIONS = {option.name: option for *_, members in GROUPS for option in members if isinstance(option, SceneOption)}
