"""Hostile values and hostile bytes."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from tools.campaigns.runner import SECRET

BYTES_MAX = 1 << 20
"""Largest file of a case: the promise about memory is made for these."""

NUMBERS: tuple[Any, ...] = (
    0, 1, -1, 2, 3, 7, 63, 64, 255, 256, 1023, 1024, 65535, 65536, 2**31 - 1, 2**31, -(2**31) - 1, 2**32, 2**53 + 1,
    2**63 - 1, 2**63, -(2**63), 2**64, 2**70, 10**30, 10**400, 0.0, -0.0, 0.5, -0.5, 1.5, 5e-324, -5e-324, 1e-300, 1e-9,
    999.9999999999999, 1e5, 1e6, 1e7, 1e9, -1e9, 1e15, 1e18, 1e20, -1e20, 1e100, 1e300, 1e308, -1e308,
    1.7976931348623157e308, float("inf"), float("-inf"), float("nan"),
)  # fmt: skip
"""Numbers at and beyond the ends of what types and formulas can take."""

OTHERS: tuple[Any, ...] = (
    None, True, False, "", " ", "1", "nan", "\0", "\x1b[31m", "\ud800", SECRET, "x" * 10_000, "../../etc/passwd",
    "/dev/zero/x", "nowhere.toml", b"", b"\xff" * 300, (), [], {}, [SECRET] * 40, {SECRET: SECRET}, (1.0, 2.0),
    [1e308] * 2,
    [[1], [2, 3]], [float("nan")] * 3, object(), 1j, len, int, range(3), slice(1), Ellipsis,
    np.float64("nan"), np.float32(1e30), np.int64(-1), np.uint64(2**64 - 1), np.bool_(True), np.array(5.0),
    np.array([]),
    np.array([1e308, -1e308]), np.full((3, 3), np.nan), np.array(["a", "b"]), np.array([None, 1], object),
    np.zeros((2, 2, 2)), np.arange(4, dtype=np.uint8), np.array([1 + 2j]), np.datetime64("NaT", "s"),
    np.zeros((120, 120), np.uint8),
)  # fmt: skip
"""Values of other types."""


def hostile_value(rng: random.Random) -> Any:
    """Return any of them; whole numbers and fractions also as NumPy has them."""
    if rng.random() < 0.4:
        return rng.choice(OTHERS)
    number = rng.choice(NUMBERS)
    if rng.random() < 0.1 and abs(number) < 2**63:
        return np.float64(number)
    return number


# ---- bytes ----


def mutated(rng: random.Random, data: bytes, others: Sequence[bytes] = ()) -> bytes:
    """Return bytes with a few things done to them."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        data = rng.choice(_BYTE_MUTATIONS)(rng, data, others or (data,))[:BYTES_MAX]
    return data


def _span(rng: random.Random, data: bytes, longest: int = 1 << 20) -> tuple[int, int]:
    begin = rng.randint(0, len(data))
    return begin, min(begin + int(rng.paretovariate(0.5)), len(data), begin + longest)


def _flip(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    flipped = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8)) if data else 0):
        flipped[rng.randrange(len(flipped))] ^= 1 << rng.randrange(8)
    return bytes(flipped)


def _set(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    place, width = rng.randint(0, len(data)), rng.choice((1, 2, 4, 8))
    value = rng.choice((0, 1, 0x7F, 0x80, 0xFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)) % (1 << 8 * width)
    return data[:place] + value.to_bytes(width, rng.choice(("little", "big"))) + data[place + width :]


def _cut(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    return data[: rng.randint(0, len(data))]


def _delete(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    begin, end = _span(rng, data)
    return data[:begin] + data[end:]


def _repeat(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    begin, end = _span(rng, data)
    times = min(rng.choice((2, 3, 100, 10_000)), BYTES_MAX // max(end - begin, 1))
    return data[:begin] + data[begin:end] * times + data[end:]


def _insert(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    place = rng.randint(0, len(data))
    return data[:place] + rng.randbytes(rng.choice((1, 2, 8, 300))) + data[place:]


def _splice(rng: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    other = rng.choice(others)
    begin, end = _span(rng, other)
    place = rng.randint(0, len(data))
    return data[:place] + other[begin:end] + data[place + rng.choice((0, end - begin)) :]


_BYTE_MUTATIONS = (_flip, _flip, _set, _cut, _delete, _repeat, _insert, _splice)


# ---- TOML and JSON ----

_VALUE = re.compile(rb"-?\d[\d_]*(?:\.\d+)?(?:e[+-]?\d+)?|\"[^\"\n]*\"|\btrue\b|\bfalse\b|\[[^\[\]\n]*\]")
_KEY = re.compile(rb"^[ \t]*\"?([A-Za-z_]\w*)\"?(?=\s*[=:])", re.MULTILINE)
_LINE = re.compile(rb"^.*\n", re.MULTILINE)

_LITERALS = [
    repr(number).encode()
    for number in NUMBERS
    if abs(number) < 10**40 or number != number or number in (np.inf, -np.inf)
]
_TEXTS = ("", " ", "kiks", "../../etc/passwd", "/dev/zero", "x" * 5000, SECRET)
_TOML_LITERALS = (
    *_LITERALS, b"9" * 400, b"9" * 5000, b"-" + b"9" * 400 + b".5", b"1e400", b"1e99999999", b"0x" + b"f" * 300,
    b"true",
    b"[]", b"{}", b"[[]]", b"[nan, inf]", b"[1, 'a', 2.5]", b"1979-05-27T07:32:00Z", b"07:32:00", b"1979-05-27",
    b"[" * 300 + b"]" * 300, b"[" * 5000 + b"]" * 5000, b"{a=" * 2000 + b"1" + b"}" * 2000,
    b"[" + b"1," * 20_000 + b"]",
    b'"\\u0000"', b'"\\u001b[31m"', b"'''\n\n'''", *(f'"{text}"'.encode() for text in _TEXTS),
    b'["' + SECRET.encode() + b'"]',
    b'{"' + SECRET.encode() + b'" = 1}', b"[[1, 2], [3]]", b"[1e308, 1e308, 1e308, 1e308, 1e308, 1e308, 1e308, 1e308]",
    b"[nan, nan, nan, nan, nan, nan, nan, nan]", b"[1e20, 0, 0, 0, 0, 0, 0, 0]",
)  # fmt: skip
_JSON_LITERALS = (
    *(word.replace(b"inf", b"Infinity").replace(b"nan", b"NaN") for word in _LITERALS), b"9" * 400, b"9" * 5000,
    b"1e400",
    b"null", b"true", b"[]", b"{}", b"[[]]", b"[NaN, Infinity]", b'[1, "a"]', b"[" * 300 + b"]" * 300,
    b"[" * 100_000 + b"]" * 100_000, b'{"a":' * 50_000 + b"1" + b"}" * 50_000, b"[" + b"1," * 20_000 + b"1]",
    b'"\\u0000"',
    b'"\\ud800"', *(f'"{text}"'.encode() for text in _TEXTS), b'{"' + SECRET.encode() + b'": 1}',
)  # fmt: skip


def mutated_text(rng: random.Random, data: bytes, others: Sequence[bytes] = (), *, is_json: bool = False) -> bytes:
    """Return TOML or JSON with other values, keys, lines; often it can still be read."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        choice = rng.random()
        if choice < 0.6:
            data = _with(rng, data, _VALUE, rng.choice(_JSON_LITERALS if is_json else _TOML_LITERALS))
        elif choice < 0.7:
            data = _with(rng, data, _KEY, _key(rng, data))
        elif choice < 0.8:
            line = _one(rng, data, _LINE)
            data = _with(rng, data, _LINE, rng.choice((b"", line, line * 2, line * 50)))
        elif choice < 0.85:
            data = data.replace(_one(rng, data, _VALUE) or b"\0", rng.choice(_TOML_LITERALS))
        elif choice < 0.88 and not is_json:
            data += (
                b"\n"
                + rng.choice((b".".join([b"a"] * rng.choice((200, 20_000, 60_000))), _one(rng, data, _KEY)))
                + b" = 1\n"
            )
        elif choice < 0.9 and not is_json:
            data += b"\n" + rng.choice((b"[a]\n", b"[[robot]]\n", b"[walls.x]\n", b"[" + b"a." * 20_000 + b"b]\n"))
        else:
            data = mutated(rng, data, others)
        data = data[:BYTES_MAX]
    return data


def _one(rng: random.Random, data: bytes, pattern: re.Pattern[bytes]) -> bytes:
    found = pattern.findall(data)
    return rng.choice(found) if found else b""


def _key(rng: random.Random, data: bytes) -> bytes:
    other = _one(rng, data, _KEY) or b"a"
    return rng.choice(
        (other, other + b"x", b"a.b", b"a." * 20_000 + b"b", SECRET.encode(), b'"' + SECRET.encode() * 3 + b'"')
    )


def _with(rng: random.Random, data: bytes, pattern: re.Pattern[bytes], new: bytes) -> bytes:
    """Return a text with one of the matches of a pattern replaced."""
    matches = list(pattern.finditer(data))
    if not matches:
        return data + new
    match = rng.choice(matches)
    return data[: match.start()] + new + data[match.end() :]
