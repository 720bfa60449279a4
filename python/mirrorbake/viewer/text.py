"""Bytes as text inside of a page: a seventh longer than they are, where base64 adds a third."""

from __future__ import annotations

import re

import numpy as np

FORBIDDEN = b'\0\n\r"<\\'
"""What a string in a script, or HTML around it, does not keep as it is."""

_PAIR = re.compile(b"([" + re.escape(FORBIDDEN) + b"])([\0-\x7f])", re.DOTALL)


def text_of_bytes(data: bytes) -> str:
    r"""Return bytes as characters that a JavaScript string between double quotes holds without escapes.

    The bits are cut into groups of seven, the highest first, and each is the ASCII character of that number.
    A forbidden one, `FORBIDDEN[k]`, and the group that follows it become one character, 128 (k + 1) plus that
    group, which UTF-8 writes as two bytes: so the text takes 8/7 of the bytes, whatever they are.
    `bytesOfText` in `viewer/src/text.ts` is the inverse; it has to be told the number of bytes.

    Examples
    --------
    >>> text_of_bytes(b"\xff\xff"), text_of_bytes(b"\0\0\0")
    ('\x7f\x7f`', '\x80\x80')
    """
    bits = np.unpackbits(np.frombuffer(data, np.uint8))
    count = -(-len(bits) // 7)
    groups = np.zeros((count, 8), np.uint8)
    groups[:, 1:] = np.pad(bits, (0, 7 * count - len(bits))).reshape(count, 7)
    # A forbidden group at the end needs another one behind it; where none needs it, it is taken away again.
    text = _PAIR.sub(_two_groups, np.packbits(groups).tobytes() + b"\0")
    return text.removesuffix(b"\0").decode("utf-8")


def _two_groups(pair: re.Match[bytes]) -> bytes:
    return chr(128 * (FORBIDDEN.index(pair[1]) + 1) + pair[2][0]).encode("utf-8")
