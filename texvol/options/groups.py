"""The scene options in groups, in the order in which --help has them."""

from __future__ import annotations

from texvol.annotation import PARTS
from texvol.options import cutting as cut
from texvol.options import light as lit
from texvol.options import meshes as geometry
from texvol.options import texts
from texvol.options.scene_option import SceneOption
from texvol.options.volumes import ADD, LOOK, OF_ADDED, POSITION, OfAdded
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CLASSIFICATIONS, COLORINGS, MODES


def _parts(text: str) -> tuple[str, ...]:
    """Names of annotation."""
    names = tuple(each.strip() for each in text.split(",") if each.strip())
    for name in names:
        texts.choice(*PARTS)(name)
    return names


# Title of a group, what it says, and its options.
GROUPS: tuple[tuple[str, str | None, tuple[SceneOption | OfAdded, ...]], ...] = (
    (
        "scene",
        "What is drawn. All options of this and the next seven groups may stand in the scene file, as keys; "
        "an option on the line wins.",
        (
            *LOOK,
            SceneOption(
                "classification", texts.choice(*CLASSIFICATIONS), "KIND",
                "slab (default), extinction, post or integrated",
            ),
            *POSITION,
            SceneOption("size", texts.size, "WxH", "pixels (512x512)"),
            SceneOption("background", texts.color, "R,G,B", "linear light from behind (0,0,0), or: transparent"),
            SceneOption(
                "gradient", lit.gradient, "KIND",
                "central (default), zucker-hummel, or gaussian[:SCALE], which smooths over SCALE samples (1); "
                "computed only where light, contours or an isosurface need it",
            ),
        ),
    ),
    (
        "further volumes",
        "Where volumes overlap, their extinction adds up, and so does their emission. Each --add begins one, and what "
        "follows it here is of the last. In a scene file they are tables: [[add]], with file, and these names without "
        "add-.",
        (ADD, *OF_ADDED),
    ),
    (
        "camera",
        None,
        (
            SceneOption(
                "projection", texts.choice("orthographic", "perspective"), "KIND",
                "orthographic (default) or perspective",
            ),
            SceneOption(
                "eye", texts.triple, "X,Y,Z", "where the camera is, world units (so that the whole box is seen)"
            ),
            SceneOption("target", texts.triple, "X,Y,Z", "what it looks at (the middle of the box)"),
            SceneOption("up", texts.triple, "X,Y,Z", "what is up in the picture (0,0,1)"),
            SceneOption("fov", texts.number, "DEGREES", "angle from bottom to top, perspective (40)"),
            SceneOption("height", texts.number, "H", "world units from bottom to top, orthographic (the box)"),
        ),
    ),
    (
        "light",
        "Without --light matter shows its own colour. An isosurface has a head light, and so has matter with any of "
        "--ambient, --diffuse, --specular, --shininess, --two-sided, --fade and --shadows.",
        (
            SceneOption(
                "light", lit.light, "SPEC",
                "head; directional:X,Y,Z or X,Y,Z, where it comes from; point:X,Y,Z, where it is; each may end with "
                "a colour :R,G,B or :I. Give it again for further lights. ambient: only light from everywhere, of "
                "--ambient; depth: no light, but shading by depth; none: no light, whatever the scene file says",
                lit.light_table,
            ),
            SceneOption("ambient", lit.fraction, "A", f"light from everywhere ({Lighting.ambient:g})"),
            SceneOption("diffuse", lit.fraction, "D", f"share of light that matter scatters ({Lighting.diffuse:g})"),
            SceneOption("specular", lit.fraction, "S", f"share of light in highlights ({Lighting.specular:g})"),
            SceneOption("shininess", lit.fraction, "N", f"the higher, the smaller highlights ({Lighting.shininess:g})"),
            SceneOption(
                "two-sided", bool, "", "light the side that faces the eye (default), or only the side of lower values"
            ),
            SceneOption(
                "fade", lit.fraction, "G",
                "gradient magnitude, data units per world unit, under which shading fades out "
                "(a hundredth of the range of values per sample)",
            ),
            SceneOption("shadows", bool, "", "matter takes light from what lies behind it, or not (default)"),
            SceneOption(
                "depth-cue", lit.depth_cue, "S[,R,G,B][:NEAR,FAR]",
                "mix what is farther with a colour (black), the farthest corner by S, from 0 to 1; or by nothing up to "
                "depth NEAR, and by S from depth FAR on, world units from the eye (either may be left out)",
                from_value=lit.depth_cue_value,
            ),
        ),
    ),
    (
        "cutting",
        "Of the volume only what lies inside of all of these is seen.",
        (
            SceneOption(
                "clip", cut.clip_plane, "NX,NY,NZ,D",
                "keep what has NX x + NY y + NZ z >= D, world units; give it again for further planes",
                cut.clip_plane_table,
            ),
            SceneOption("crop", cut.crop_box, "X0,X1,Y0,Y1,Z0,Z1", "keep what lies in this box, world units"),
            SceneOption(
                "caps", bool, "", "matter that is cut open is opaque there, in its own colour, or not (default)"
            ),
        ),
    ),
    (
        "geometry",
        None,
        (
            SceneOption(
                "mesh", geometry.mesh, "FILE[:R,G,B][:A]",
                "surface in the volume, PLY, STL, OBJ or VTP, world units; with a colour (linear) and an opacity of "
                "its own; give it again for further ones",
                geometry.mesh_table,
            ),
        ),
    ),
    (
        "annotation",
        "Drawn into PNG, JPEG and films, never into the data of an EXR.",
        (
            SceneOption("annotate", _parts, "PART,PART", f"what explains the picture: {', '.join(PARTS)}"),
            SceneOption("title", str, "TEXT", "one line on top"),
            SceneOption("value-name", str, "TEXT", "what the values are, for the legend, such as HU"),
            SceneOption("font", str, "FILE", "TrueType font, for letters that DejaVu Sans lacks"),
        ),
    ),
    (
        "projection mode",
        None,
        (
            SceneOption(
                "mode", texts.choice(*MODES), "MODE",
                "composite (default): emission and absorption; xray, mip, minip, average: the value's integral, "
                "maximum, minimum or average along each ray; isosurface: the first surface of --isovalue",
            ),
            SceneOption("isovalue", lit.finite, "V", "value of the isosurface, data units"),
            SceneOption(
                "air", texts.air, "V|hounsfield|none",
                "xray integrates what values are above V; hounsfield: attenuation relative to water, max(0, 1 + HU / "
                "1000); none: the values themselves. In 8-bit pictures hounsfield where the data are Hounsfield units "
                "(see texvol info), else the least value; in EXR none",
            ),
            SceneOption(
                "window", lit.window, "CENTRE,WIDTH",
                "numbers from black to white in 8-bit pictures of xray, mip, minip and average",
            ),
            SceneOption(
                "coloring", texts.choice(*COLORINGS), "HOW",
                "8-bit pictures of xray, mip, minip and average: grey (default), or tf (default where --tf is given "
                "and no --window): in the colours that the transfer function has for the numbers",
            ),
        ),
    ),
)  # fmt: skip
SCENE_OPTIONS = {option.name: option for *_, members in GROUPS for option in members if isinstance(option, SceneOption)}
