"""Programs from the files in shaders/, in which every name counts: a missing one is an error, with file and line.

A file may `#include "other.glsl"`, once each however often it is asked for. Switches are defined right after its
`#version` line.

Lines from `#each SWITCH` to `#end` stand as often as the switch says, each time with its number, from 0 on, in place of
`@` and at the end of every name that the lines or what they include declare, of names that end in a number, and of
switches that come with one: so what is written for one can be had several times.

A file may also `#include NAME`, of which whoever loads it says which file that is.

A `flat uniform` of a fragment shader is a uniform that comes to it through the vertex shader, as a flat input: Mesa's
software driver fetches a uniform for each pixel of a vector by itself, and what is flat once for all. There is room for
some 30 of them, of up to four numbers: in lines that stand several times, and for drivers that have less, each is a
plain uniform.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache, partial
from itertools import takewhile
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar, cast

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.util.package import PACKAGE
from texvol.util.termination import postponed

# An installed wheel has the files inside the package, a checkout beside it.
FOLDER = next((path for path in (PACKAGE / "shaders", PACKAGE.parent / "shaders") if path.is_dir()), PACKAGE)

_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"\s*$')
_INCLUDE_NAMED = re.compile(r"^#include ([A-Z]+)$")
_EACH = re.compile(r"^#each (\w+)$")
_END = "#end"
# A declaration begins its line: nothing inside of a function or a struct does.
_DECLARED = re.compile(r"^(?:(?:uniform|const|flat|in|out) )*\w+ (\w+) *(?:[\[;=({]|$)|^#define (\w+)", re.MULTILINE)
_NAME = re.compile(r"\b[A-Za-z_]\w*")
_LETTER = re.compile(r"\w")
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_CONDITION = re.compile(r"^\s*#\s*(?:if|elif|ifdef|ifndef)\b(.*)$", re.MULTILINE)
_FLAT = re.compile(r"^flat uniform (\w+) (\w+)((?:\[\w+\])?);")
_ROOM = 120  # numbers from one stage to the next, that a driver takes
_GIVEN = "given_"  # begins the name of a flat uniform in the vertex shader
_BRANCH = re.compile(r"^\s*#\s*(?:if|ifdef|ifndef|elif|else|endif)\b")
_MAIN = re.compile(r"\bvoid main\(\) \{")
_EXTENSION = re.compile(r"^#extension .*$", re.MULTILINE)
_DEFINITION = re.compile(r"^\s*#\s*define\s+(\w+)", re.MULTILINE)
# Files are told apart by their line numbers, which start at this for the first, at twice this for the second, and so
# on: Mesa 22 forgets #line's second number, the source string, for function calls.
_LINES_PER_FILE = 10_000
# Where a message points to: Mesa writes 0:12(3):, NVIDIA 0(12) :, others ERROR: 0:12:.
_POSITION = re.compile(r"^(?:ERROR: )?\d+(?::(\d+)(?:\(\d+\))?|\((\d+)\)) ?: ?", re.MULTILINE)


AnyProgram = moderngl.Program | moderngl.ComputeShader
Program = TypeVar("Program", moderngl.Program, moderngl.ComputeShader)
_MOST_PROGRAMS = 64  # kept: some 4 MB each in Mesa's software driver; scenes that alternate use a few
WHOLE_TARGET = np.array([-1, -1, 3, -1, -1, 3], np.float32)  # `in_position` of a triangle that covers every pixel


class ShaderError(RuntimeError):
    """A shader file, or the Python that uses it, is wrong; the message names the file and line where there is one."""


class Programs:
    """The programs of one context that were used last, by name and switches; `folder` is that of their files."""

    def __init__(self, gl: moderngl.Context, folder: Path) -> None:
        self._gl, self._folder = gl, folder
        self.kept: dict[tuple[Any, ...], AnyProgram] = {}

    def program(self, name: str, switches: Mapping[str, int], vertex: str) -> moderngl.Program:
        """Return the program of `name`.frag and a vertex shader."""
        load = partial(load_program, self._gl, name, defines=switches, vertex=vertex, folder=self._folder)
        key = (name, *sorted(switches.items()))
        return self._kept(key, load)

    def compute(
        self, name: str, switches: Mapping[str, int], named: Mapping[str, str] = MappingProxyType({})
    ) -> moderngl.ComputeShader:
        """Return the compute shader `name`.comp; `named` are the files that it includes by names."""
        load = partial(load_compute, self._gl, name, named=named, defines=switches, folder=self._folder)
        return self._kept((" ".join([f"{name}.comp", *named.values()]), *sorted(switches.items())), load)

    def _kept(self, key: tuple[Any, ...], load: Callable[[], Program]) -> Program:
        program = cast(Program, self.kept.pop(key, None)) or load()
        self.kept[key] = program  # the last one used is the last
        if len(self.kept) > _MOST_PROGRAMS:
            self.kept.pop(next(iter(self.kept))).release()
        return program

    def release(self) -> None:
        """Release all programs."""
        for program in self.kept.values():
            program.release()
        self.kept.clear()


def load_program(
    gl: moderngl.Context,
    name: str,
    *,
    defines: Mapping[str, int] = MappingProxyType({}),
    vertex: str | None = None,
    folder: Path = FOLDER,
) -> moderngl.Program:
    """Return the program made of `name`.frag and a vertex shader, which the caller releases; `gl` is current.

    Parameters
    ----------
    defines : mapping
        Switch and value; the two files together name exactly these.
    vertex : str, optional
        Another file than `name`.vert.

    Raises
    ------
    ShaderError
        A file is missing, a switch is unknown or has no value, or the driver refuses the source.
    """
    names = vertex or f"{name}.vert", f"{name}.frag"
    has_room = gl.info["GL_MAX_VERTEX_OUTPUT_COMPONENTS"] >= _ROOM
    stages = _stages if folder == FOLDER else _stages.__wrapped__
    sources, files = stages(folder, names, tuple(defines.items()), has_room)
    try:
        with (
            postponed()
        ):  # moderngl makes Python objects of the uniforms, and an exception there is a segmentation fault
            return gl.program(vertex_shader=sources[0], fragment_shader=sources[1])
    except moderngl.Error as error:
        raise ShaderError(f"{' and '.join(names)}: {_with_files(str(error), files)}") from None


@lru_cache(2 * _MOST_PROGRAMS)  # some 0.1 MB each, and 9 ms for the programs of a second Renderer
def _stages(
    folder: Path, names: tuple[str, str], defines: tuple[tuple[str, int], ...], has_room: bool
) -> tuple[tuple[str, str], list[str]]:
    """Return the text of a vertex and a fragment shader, and the files that it is made of."""
    files: list[str] = []
    vertex, fragment = (_source(folder, file, dict(defines), files) for file in names)
    _check_switches([vertex, fragment], dict(defines), " and ".join(names))
    if has_room:
        vertex = _handing_on(vertex, fragment)
    return (vertex, fragment.replace("\nflat uniform ", "\nflat in " if has_room else "\nuniform ")), files


def load_compute(
    gl: moderngl.Context,
    name: str,
    *,
    named: Mapping[str, str] = MappingProxyType({}),
    defines: Mapping[str, int] = MappingProxyType({}),
    folder: Path = FOLDER,
) -> moderngl.ComputeShader:
    """Return the compute shader `name`.comp, which the caller releases; `gl` is current.

    `named` are the files that it includes by names.

    Raises
    ------
    ShaderError
        As for `load_program`.
    """
    files: list[str] = []
    source = _source(folder, f"{name}.comp", defines, files, named)
    names = " and ".join([f"{name}.comp", *named.values()])
    _check_switches([source], defines, names)
    try:
        with postponed():  # see load_program
            return gl.compute_shader(source.replace("\nflat uniform ", "\nuniform "))
    except moderngl.Error as error:
        raise ShaderError(f"{names}: {_with_files(str(error), files)}") from None


def set_uniforms(program: AnyProgram, values: Mapping[str, Any]) -> None:
    """Set uniforms by name.

    Raises
    ------
    ShaderError
        The program has no such uniform: it is misspelled, or nothing uses it and the linker dropped it.
    """
    active = _active(program)
    dropped = [name for name in values if name not in active]
    if dropped:
        raise ShaderError(f"the program has no uniform {', '.join(dropped)}; it has {', '.join(active) or 'none'}")
    for name, value in values.items():
        try:
            # moderngl takes the items of an array, but for one of a single item that item itself.
            program[active[name]] = value[0] if isinstance(value, list) and len(value) == 1 else value
        except Exception as error:  # moderngl lets struct.error, TypeError and its own Error through
            raise ShaderError(f"uniform {name} cannot be {value!r}: {error}") from error


def used(program: AnyProgram, named: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of the uniforms or textures of another program that this one has as well."""
    active = _active(program)
    return {name: value for name, value in named.items() if name in active}


def _active(program: AnyProgram) -> dict[str, str]:
    """The names of a program's uniforms, and those that they have in the program itself."""
    uniforms = (name for name in program if isinstance(program[name], moderngl.Uniform))
    return {name.removeprefix(_GIVEN): name for name in uniforms}


def bind(program: AnyProgram, textures: Mapping[str, Any], uniforms: Mapping[str, Any]) -> None:
    """Set uniforms, and bind textures by the names of their samplers."""
    for unit, texture in enumerate(textures.values()):
        texture.use(unit)
    set_uniforms(program, {name: unit for unit, name in enumerate(textures)} | dict(uniforms))


def draw_triangles(
    gl: moderngl.Context, program: moderngl.Program, vertices: NDArray[np.float32], layout: str, *attributes: str
) -> None:
    """Draw triangles whose vertices hold the attributes in a moderngl buffer format, such as "2f 2f"."""
    buffer = gl.buffer(vertices)
    array = gl.vertex_array(program, [(buffer, layout, *attributes)])
    try:
        array.render(moderngl.TRIANGLES)
    finally:
        array.release()
        buffer.release()


def release_target(gl: moderngl.Context, target: moderngl.Framebuffer) -> None:
    """Release a framebuffer and its textures."""
    gl.screen.use()  # moderngl binds the last framebuffer again, also one that is gone
    for attachment in target.color_attachments:
        attachment.release()
    target.release()


def _source(
    folder: Path,
    file: str,
    defines: Mapping[str, int],
    files: list[str],
    named: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Text of one stage: includes in their places, also `named` ones, switches after the #version line."""
    lines = list(_Lines(folder, files, defines, named).of(file, set()))
    version = next((i for i, line in enumerate(lines) if line.lstrip().startswith("#version")), None)
    if version is None:
        raise ShaderError(f"{file} has no #version line")
    switches = [f"#define {switch} {value}" for switch, value in defines.items()]
    lines[version + 1 : version + 1] = [*switches, _line(files, file, version + 2)]
    return "\n".join(lines) + "\n"


class _Lines:
    """The lines of files and of what they include; `files` becomes all of them, and `named` are files by names."""

    def __init__(self, folder: Path, files: list[str], defines: Mapping[str, int], named: Mapping[str, str]) -> None:
        self._folder, self._files, self._defines, self._named = folder, files, defines, named
        self._numbered = {name.removesuffix("_0") for name in defines if name.endswith("_0")}

    def of(self, file: str, seen: set[str]) -> Iterator[str]:
        """Yield the lines, with a #line wherever the file changes; `seen` becomes what is included."""
        try:
            text = (self._folder / file).read_text(encoding="utf-8")
        except OSError as error:
            raise ShaderError(f"shader file {self._folder / file} cannot be read: {error.strerror}") from None
        seen.add(file)
        if file not in self._files:
            self._files.append(file)
        if len(seen) > 1:  # only comments may stand before the #version of the first
            yield _line(self._files, file, 1)
        yield from self._expanded(file, list(enumerate(text.splitlines(), start=1)), seen)

    def _expanded(self, file: str, lines: list[tuple[int, str]], seen: set[str]) -> Iterator[str]:
        rest = iter(lines)
        for number, line in rest:
            if "#" not in line:  # most lines, which need no look at what they might be
                yield line
                continue
            if (name := _INCLUDE_NAMED.match(line)) and name[1] in self._named:
                line = f'#include "{self._named[name[1]]}"'
            include, each = _INCLUDE.match(line), _EACH.match(line)
            if not include and not each:
                yield line
                continue
            if include and include[1] not in seen:
                if not (self._folder / include[1]).is_file():
                    raise ShaderError(f"{file}:{number}: {include[1]} is not in {self._folder}")
                yield from self.of(include[1], seen)
            elif each:
                yield f"#if {each[1]}\n#endif"  # so that who looks for switches finds it
                block = list(takewhile(lambda numbered: numbered[1] != _END, rest))
                yield from self._repeated(file, block, self._count(each[1], file, number), seen)
                number += len(block) + 1
            yield _line(self._files, file, number + 1)

    def _repeated(self, file: str, block: list[tuple[int, str]], count: int, seen: set[str]) -> Iterator[str]:
        """A block, once for each number; what it includes is included each time."""
        first = block[0][0] if block else 1
        for which in range(count):
            lines = list(self._expanded(file, block, set(seen)))
            self._numbered.update(name for pair in _DECLARED.findall("\n".join(lines)) for name in pair if name)
            yield _line(self._files, file, first)
            for line in lines:
                line = line.removeprefix("flat ") if _FLAT.match(line) else line
                yield _NAME.sub(partial(self._name, which), line).replace("@", str(which))

    def _name(self, which: int, match: re.Match[str]) -> str:
        name = match[0]
        return f"{name}_{which}" if name in self._numbered or re.search(r"_\d+$", name) else name

    def _count(self, switch: str, file: str, number: int) -> int:
        if switch not in self._defines:
            raise ShaderError(f"{file}:{number}: {switch} needs a value")
        return self._defines[switch]


def _handing_on(vertex: str, fragment: str) -> str:
    """The vertex shader, which also hands on what is a flat uniform of the fragment shader."""
    lines = [line for line in fragment.replace("\\\n", " ").split("\n") if "#" in line or line.startswith("flat ")]
    main = _MAIN.search(vertex)
    if not main or not any(map(_FLAT.match, lines)):
        return vertex
    # Conditions stay around them, and definitions that those rest on.
    kept = [line for line in lines if _FLAT.match(line) or _BRANCH.match(line) or _DEFINITION.match(line)]
    declared = [_FLAT.sub(rf"uniform \1 {_GIVEN}\2\3; flat out \1 \2\3;", line) for line in kept]
    handed = [_FLAT.sub(rf"\2 = {_GIVEN}\2;", line) for line in kept if not _DEFINITION.match(line)]
    start = vertex.index("#line", vertex.index("#version"))  # behind version and switches
    begin = [vertex[:start], *_EXTENSION.findall(fragment), "#define main own_main", vertex[start:], "#undef main"]
    return "\n".join([*begin, *declared, main[0], "own_main();", *handed, "}"]) + "\n"


def _line(files: list[str], file: str, number: int) -> str:
    """Directive that tells the driver where the next line comes from."""
    return f"#line {(files.index(file) + 1) * _LINES_PER_FILE + number}"


def _check_switches(sources: list[str], defines: Mapping[str, int], files: str) -> None:
    """Raise unless the sources use every switch, and every name in their conditions has a value."""
    # The preprocessor takes a name that it does not know as 0, so a misspelled switch would be off without a word.
    code = "\n".join(_COMMENT.sub("", source) for source in sources)
    # Once each in its #define.
    unused = [switch for switch in defines if _occurrences(switch, code, len(sources) + 1) <= len(sources)]
    if unused:
        raise ShaderError(f"{files} have no switch {', '.join(unused)}")
    known = {"defined", *_DEFINITION.findall(code)}
    asked = re.findall(r"\b[A-Za-z_]\w*", " ".join(_CONDITION.findall(code)))
    unknown = sorted({word for word in asked if word not in known and not word.startswith(("GL_", "__"))})
    if unknown:
        raise ShaderError(f"{files} need a value for {', '.join(unknown)}")


def _occurrences(name: str, code: str, most: int) -> int:
    """Return how often a name stands in the code, up to `most` times; to list all words takes ten times as long."""
    count, place = 0, code.find(name)
    while place >= 0 and count < most:
        end = place + len(name)
        count += _LETTER.search(code[max(place - 1, 0) : place] + code[end : end + 1]) is None
        place = code.find(name, end)
    return count


def _with_files(message: str, files: list[str]) -> str:
    """The driver's message with file:line in place of its numbers."""

    def position(match: re.Match[str]) -> str:
        file, line = divmod(int(match[1] or match[2]), _LINES_PER_FILE)
        return f"{files[file - 1]}:{line}: " if 1 <= file <= len(files) else match[0]

    return _POSITION.sub(position, message)
