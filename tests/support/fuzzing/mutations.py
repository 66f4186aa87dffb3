"""Damage to files: bits, bytes, numbers, cuts, and tokens and lines of their texts; the same for the same random state.

Damage of one file is one to four steps. Where the content is packed as a whole, or has checksums that a library holds
it against first, half of the damage is done inside, and packed or summed again.
"""

from __future__ import annotations

import bz2
import gzip
import re
import struct
import zlib
from collections.abc import Callable, Sequence
from random import Random

_REACHES = (200, 1500, 1 << 30, 1 << 30)  # bytes: headers are where the harm is
_MOST_TEXT = (200, 4000, 4000)  # bytes of text that are taken apart

NUMBERS = (
    b"0", b"1", b"-1", b"2", b"3", b"4", b"7", b"8", b"16", b"127", b"128", b"255", b"256", b"1000", b"65535",
    b"65536", b"100000", b"1000000", b"100000000", b"2147483647", b"2147483648", b"-2147483648", b"4294967295",
    b"4294967296", b"9223372036854775807", b"9223372036854775808", b"-9223372036854775808",
    b"18446744073709551616", b"1e-320", b"1e-30", b"1e30", b"1e38", b"1e39", b"1e308", b"1e309", b"-1e308",
    b"nan", b"NaN", b"inf", b"-inf", b"Infinity", b"0.5", b"0x10", b"-0", b"-0.0", b"1_000", b"007", b"1,5",
    b"\xd9\xa3", b"9" * 400, b"9" * 5000, b"", b"0." + b"0" * 400 + b"1", b"true",
)  # fmt: skip
WORDS = (
    b"null", b"true", b"None", b"[]", b"{}", b"[", b"]", b"{", b"}", b'"', b"'", b",", b":", b"=", b"#", b"\\",
    b"/", b"..", b"../../../etc/passwd", b"/dev/zero", b"/proc/self/mem", b".", b"%d", b"%s", b"%099999d",
    b"%n", b"\x00", b"\xff\xfe", b"\x1b[31m", b"\x1b]0;t\x07", b"\r", b"\n", b"\r\n", b"\n\n", b"\t",
    b"\xc3\x28", b"\xed\xa0\x80", b"\xe2\x80\xae", b"\\u0000", b"\\ud800", b"&lt;", b"&#0;", b"<!--", b"]]>",
    b"A" * 300, b"[" * 3000, b'{"a":' * 2000,
    b"(" * 200, b"__class__", b"int", b"float", b"double", b"uchar", b"short", b"raw",
    b"gzip", b"ascii", b"LIST", b"LOCAL", b"block", b"signed",
)  # fmt: skip
_EXTREMES = tuple(
    struct.pack(form, number)
    for mark in "<>"
    for form, numbers in (
        (f"{mark}B", (0, 1, 127, 128, 255)),
        (f"{mark}H", (0, 1, 2, 32767, 32768, 65535)),
        (f"{mark}I", (0, 1, 2**16, 2**24, 2**31 - 1, 2**31, 2**32 - 1)),
        (f"{mark}Q", (0, 1, 2**32, 2**40, 2**62, 2**63 - 1, 2**63, 2**64 - 1)),
        (f"{mark}f", (0.0, -1.0, 1e-38, 3e38, float("inf"), float("nan"))),
        (f"{mark}d", (-1.0, 1e-308, 1e308, float("inf"), float("nan"))),
    )
    for number in numbers
)
_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_TOKEN = re.compile(rb"[A-Za-z_][\w\-]*|[-+]?\d[\w.+\-]*|\"[^\"\n]*\"|[^\w\s]|\s+")

Step = Callable[[bytes, Random], bytes]


def damaged(content: bytes, random: Random, *, text: bool = False, others: Sequence[bytes] = ()) -> bytes:
    """Content with one to four steps of damage; `others` are files that pieces may come from."""
    for magic, unpack, pack in _PACKED:
        if content.startswith(magic) and random.random() < 0.5:
            return pack(_steps(unpack(content), random, text, others))
    if content.startswith(b"\x89PNG") and random.random() < 0.6:
        return _summed_png(_steps(content, random, False, others))
    return _steps(content, random, text, others)


def _steps(content: bytes, random: Random, text: bool, others: Sequence[bytes]) -> bytes:
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 4))):
        words = text or random.random() < 0.4
        step = random.choice(_OF_TEXT if words else _OF_BYTES)
        content = step(content, random)
    if others and random.random() < 0.03:
        content = _spliced(content, random.choice(others), random)
    return content


def _position(content: bytes, random: Random) -> int:
    reach = min(len(content), random.choice(_REACHES))
    return random.randrange(reach) if reach else 0


def _bits(content: bytes, random: Random) -> bytes:
    if not content:
        return content
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 4, 8))):
        changed[_position(content, random)] ^= 1 << random.randrange(8)
    return bytes(changed)


def _bytes(content: bytes, random: Random) -> bytes:
    at = _position(content, random)
    some = random.randbytes(random.choice((1, 1, 2, 4, 16)))
    return content[:at] + some + content[at + len(some) :]


def _extreme(content: bytes, random: Random) -> bytes:
    some = random.choice(_EXTREMES)
    at = _position(content, random)
    at -= at % len(some) if random.random() < 0.7 else 0
    return content[:at] + some + content[at + len(some) :]


def _counted(content: bytes, random: Random) -> bytes:
    """A byte that is one more, or one less."""
    at = _position(content, random)
    return content[:at] + bytes([(content[at] + random.choice((1, -1))) % 256]) + content[at + 1 :] if content else b""


def _cut(content: bytes, random: Random) -> bytes:
    return content[: _position(content, random)]


def _removed(content: bytes, random: Random) -> bytes:
    at = _position(content, random)
    return content[:at] + content[at + random.choice((1, 2, 4, 8, 64, 300)) :]


def _repeated(content: bytes, random: Random) -> bytes:
    at, length = _position(content, random), random.choice((1, 2, 4, 16, 64, 256))
    return content[:at] + content[at : at + length] * random.choice((2, 2, 3, 50)) + content[at + length :]


def _inserted(content: bytes, random: Random) -> bytes:
    at = _position(content, random)
    return content[:at] + random.randbytes(random.choice((1, 2, 4, 100))) + content[at:]


def _moved(content: bytes, random: Random) -> bytes:
    at, to, length = _position(content, random), _position(content, random), random.choice((2, 4, 8, 32, 128))
    piece, rest = content[at : at + length], content[:at] + content[at + length :]
    return rest[:to] + piece + rest[to:]


def _spliced(content: bytes, other: bytes, random: Random) -> bytes:
    return content[: _position(content, random)] + other[_position(other, random) :]


def _number(content: bytes, random: Random) -> bytes:
    """A number of the text becomes an extreme, or another of its numbers."""
    found = list(_NUMBER.finditer(content[: random.choice(_MOST_TEXT)]))
    if not found:
        return _extreme(content, random)
    one = random.choice(found)
    other = random.choice(found).group() if random.random() < 0.2 else random.choice(NUMBERS)
    return content[: one.start()] + other + content[one.end() :]


def _token(content: bytes, random: Random) -> bytes:
    """A token of the text goes, comes twice, changes places with another, or becomes another."""
    found = list(_TOKEN.finditer(content[: random.choice(_MOST_TEXT)]))
    if not found:
        return _inserted(content, random)
    one, other = sorted((random.choice(found), random.choice(found)), key=lambda match: match.start())
    head, between, tail = content[: one.start()], content[one.end() : other.start()], content[other.end() :]
    how = random.randrange(6)
    if how == 0:
        return head + content[one.end() :]
    if how == 1:
        return head + one.group() * random.choice((2, 2, 3, 500)) + content[one.end() :]
    if how == 2 and one is not other:
        return head + other.group() + between + one.group() + tail
    if how == 3:
        return head + other.group() + content[one.end() :]
    word = random.choice(WORDS)
    return head + word + content[one.end() :] if how == 4 else head + word + content[one.start() :]


def _line(content: bytes, random: Random) -> bytes:
    """A line of the text goes, comes twice, or changes places with another."""
    most = random.choice(_MOST_TEXT)
    lines = content[:most].splitlines(keepends=True)
    if len(lines) < 2:
        return _token(content, random)
    one, other, how = random.randrange(len(lines)), random.randrange(len(lines)), random.randrange(4)
    if how == 0:
        del lines[one]
    elif how == 1:
        lines.insert(other, lines[one] * random.choice((1, 1, 2, 1000)))
    elif how == 2:
        lines[one], lines[other] = lines[other], lines[one]
    else:
        lines[one] = lines[one].rstrip(b"\r\n") + random.choice((b"", b"\r\n", b" \n", b"\x00\n", lines[other]))
    return b"".join(lines) + content[most:]


_OF_BYTES: tuple[Step, ...] = (
    (_bits, _bits, _bytes, _extreme, _extreme, _counted, _cut, _removed, _repeated, _inserted, _moved)
)  # fmt: skip
_OF_TEXT: tuple[Step, ...] = (_number, _number, _number, _token, _token, _token, _line, _line, _bits, _cut)
_PACKED: tuple[tuple[bytes, Callable[[bytes], bytes], Callable[[bytes], bytes]], ...] = (
    (b"\x1f\x8b", gzip.decompress, lambda content: gzip.compress(content, mtime=0)),
    (b"BZh", bz2.decompress, bz2.compress),
)


def _summed_png(content: bytes) -> bytes:
    """A PNG whose chunks have the checksums of what they hold, as far as its chunks can be told apart."""
    summed, at = bytearray(content[:8]), 8
    while at + 12 <= len(content):
        length = min(int.from_bytes(content[at : at + 4], "big"), len(content) - at - 12)
        chunk = content[at + 4 : at + 8 + length]
        summed += content[at : at + 4] + chunk + zlib.crc32(chunk).to_bytes(4, "big")
        at += 12 + length
    return bytes(summed + content[at:])
