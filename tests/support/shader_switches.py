"""Values of switches that go together in each program, as blocks of `support.covering`.

Which do follows from texvol/opengl/uniforms.py, and from the programs' own modules beside it.
"""

from __future__ import annotations

from functools import cache
from itertools import cycle, islice

from support.covering import covering
from texvol.opengl.uniforms import NO_LIGHT, NOTHING_SPECIAL
from texvol.textures.ramps import NUMBERS_OF_RAMPS

Blocks = list[dict[str, tuple[int, ...]]]
EITHER = (0, 1)
SOME, MANY = 2, 4  # numbers of ramps: shaders/classify.glsl knows up to 3, and more


def fixed(switches: dict[str, int]) -> dict[str, tuple[int, ...]]:
    """The block of a single row."""
    return {name: (value,) for name, value in switches.items()}


# Switches of light: ambient light alone, the head light, and others with or without it.
_LIT = fixed(NO_LIGHT | {"LIT": 1})
_SHINY = {"SPECULAR": (0, 1, 6), "TWO_SIDED": EITHER}
_OTHERS = _LIT | _SHINY | {"HEAD_LIGHT": EITHER, "SHADOWS": EITHER}
LIGHTS: Blocks = [
    _LIT,
    _LIT | _SHINY | {"HEAD_LIGHT": (1,)},
    _OTHERS | {"DIRECTIONAL_LIGHTS": (1, 2), "POINT_LIGHTS": (0, 1, 2)},
    _OTHERS | {"POINT_LIGHTS": (1, 2), "FALL_OFF": EITHER},
]
UNLIT = fixed(NO_LIGHT)

# Switches of what ends and begins rays, and of what is drawn.
RAYS = {"PERSPECTIVE": EITHER, "HALF_SPACES": (0, 1, 3), "INTERVAL": EITHER, "CUE": EITHER, "COUNT": EITHER}
_WHERE = {"BRICKS": EITHER, "SKIPS": EITHER, "FETCHED": EITHER}
_VALUES = {"RAMPS": (0, SOME, MANY), "EMISSIVE": (0, 1, 2), "MISSING": EITHER, "WEIGHTS": EITHER}
_NOTHING = fixed(NOTHING_SPECIAL) | UNLIT
# Distributions of values, see texvol/textures/spread_texture.py.
_SPREAD = _NOTHING | fixed({"CLASSIFICATION": 2, "SPREAD": 1, "EMISSIVE": 1}) | {"MISSING": EITHER, "SHALLOW": EITHER}
_WITH_GRADIENT = {"GRADIENT": (1, 2)}


def _graded(*names: str) -> Blocks:
    """Blocks of what depends on the gradient, of which something is there."""
    any_of = {name: (0, 2) for name in names}
    return [_WITH_GRADIENT | any_of | {name: (2,)} for name in names]


def _classified() -> Blocks:
    """Blocks of the medium of values, classified where they are sampled (2) or integrated (3)."""
    blocks: Blocks = []
    for classification, grades in ((2, _graded("MODULATIONS", "GRADED", "CONTOURS")), (3, _graded("MODULATIONS"))):
        medium = _NOTHING | _VALUES | {"CLASSIFICATION": (classification,)}
        blocks.append(medium | {"SHALLOW": EITHER})
        blocks += [medium | light | _WITH_GRADIENT | {"SHALLOW": EITHER} for light in LIGHTS]
        blocks += [medium | light | grade for light in (UNLIT, *LIGHTS) for grade in grades]
    return blocks


def slab_stack_blocks() -> Blocks:
    """Blocks of slab_stack.glsl."""
    common = RAYS | _WHERE | {"CAPS": EITHER, "AT_ONCE": (2,), "DIVIDES": (0,)}
    slab, extinction = _NOTHING | {"CLASSIFICATION": (0,)}, _NOTHING | {"CLASSIFICATION": (1,), "SHALLOW": EITHER}
    few_registers = {"RAMPS": (SOME, MANY), "WEIGHTS": (0,), "SHALLOW": EITHER, "CLASSIFICATION": (2,)}
    return [common | medium for medium in (slab, extinction, *_classified())] + [
        common | slab | {"WHOLE_SLABS": (1,), "PERSPECTIVE": (0,)},
        common | slab | {"WHOLE_SLABS": (2,), "PERSPECTIVE": (1,)},
        common | _NOTHING | _VALUES | few_registers | {"AT_ONCE": (4,)},
        *(common | medium | {"DIVIDES": (1,)} for medium in _classified() if medium["CLASSIFICATION"] == (2,)),
        *(common | _SPREAD | light for light in (UNLIT, *(_WITH_GRADIENT | each for each in LIGHTS))),
    ]


def polygon_blocks() -> Blocks:
    """Blocks of slab_ends.frag and slab_polygon.frag: they skip nothing, and draw a slab at a time."""
    return [block | {"SKIPS": (0,), "AT_ONCE": (2,)} for block in slab_stack_blocks()]


def several_blocks() -> Blocks:
    """Blocks of several.glsl with two volumes."""
    blocks: Blocks = []
    media: Blocks = [_NOTHING | {"CLASSIFICATION": (1,)}, *_classified()]
    for media_of_both in ((first, second) for first in media for second in media):
        halves = any(medium["CLASSIFICATION"] == (3,) for medium in media_of_both)
        block = RAYS | {"CAPS": EITHER, "VOLUMES": (2,), "BLOCK": EITHER, "SHALLOW": (0,), "HALVES": (int(halves),)}
        for volume, medium in enumerate(media_of_both):
            own = {name: values for name, values in medium.items() if name not in ("WHOLE_SLABS", "SHALLOW")}
            own |= _WHERE | {"FACES": EITHER}
            block |= {f"{name}_{volume}": values for name, values in own.items()}
        blocks.append(block)
    return blocks


def projection_blocks() -> Blocks:
    """Blocks of projection.glsl."""
    off = dict.fromkeys(("WEIGHTS", "GRADIENT", "DEPTH", "ISOVALUES", "KNOWN"), (0,))
    common = RAYS | _WHERE | UNLIT | off
    surface = common | _WITH_GRADIENT | {"MODE": (3,), "MISSING": EITHER}
    surfaces = surface | {"MODE": (4,), "ISOVALUES": (1, 3)}
    return [
        common | {"MODE": (1,), "MISSING": (0, 1, 2)},
        common | {"MODE": (2,), "MISSING": EITHER, "KNOWN": EITHER},
        surface | {"DEPTH": (1,), "GRADIENT": (0, 1, 2)},
        surfaces | {"DEPTH": (1,), "GRADIENT": (0, 1, 2)},
        *(kind | light | {"SHADOWS": (0,)} for light in LIGHTS for kind in (surface, surfaces)),
    ]


def shadow_blocks() -> Blocks:
    """Blocks of shadow.frag."""
    switches = fixed(NOTHING_SPECIAL) | _VALUES
    del switches["WHOLE_SLABS"]
    where = dict.fromkeys(("POINT", "ELSEWHERE", "BRICKS", "FETCHED"), EITHER)
    common = switches | {"HALF_SPACES": RAYS["HALF_SPACES"], **where}
    # The picture's light wants gradients also where nothing else does.
    return [common | gradient for gradient in ({"GRADIENT": (0, 1, 2)}, *_graded("MODULATIONS", "GRADED", "CONTOURS"))]


@cache
def rows(program: str, strength: int | None = None, count: int | None = None) -> list[dict[str, int]]:
    """Rows of switches of a program: every three that meet, or fewer where there are many switches or known includes.

    Or every so many as `strength` says. The first `count` rows are found sooner than all.

    Numbers of ramps up to 3 stand for each other, and so do the larger ones: all of them occur.
    """
    blocks: dict[str, Blocks] = {
        "slab_stack": slab_stack_blocks(),
        "slab_ends": polygon_blocks(),
        "slab_polygon": polygon_blocks(),
        "several": several_blocks(),
        "projection": projection_blocks(),
        "shadow": shadow_blocks(),
    }
    ramps = {SOME: cycle(NUMBERS_OF_RAMPS[:2]), MANY: cycle(NUMBERS_OF_RAMPS[2:])}
    # The programs of polygons are made of the includes of slab_stack.glsl.
    usual = {"several": 2, "slab_ends": 1, "slab_polygon": 1}.get(program, 3)
    found = islice(covering(blocks[program], strength or usual), count)
    return [
        {name: next(ramps[value]) if name.startswith("RAMPS") and value else value for name, value in row.items()}
        for row in found
    ]
