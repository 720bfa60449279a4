"""Input files that are what they seem, output files that appear complete or not at all."""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from mirrorbake.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def atomic_output(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`, of the same suffix, and rename it when the block succeeds.

    Raises
    ------
    InputError
        The folder cannot be written to.
    """
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=path.suffix, dir=path.parent)
        os.close(handle)
    except OSError as failure:
        raise InputError(f"{path}: cannot write: {failure.strerror or failure}") from None
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes files that only their owner may read.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def read_text(path: Path, *, at_most: int) -> str:
    """Read a text file in UTF-8, with or without a byte-order mark.

    Parameters
    ----------
    path
        A regular file: pipes and devices, which may never end, are refused.
    at_most
        Bytes that the file may have.

    Raises
    ------
    InputError
        The file is missing, not a regular one, too long, cannot be read or is not UTF-8.
    """
    try:
        # Without waiting for the writer of a pipe.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        with os.fdopen(handle, "rb") as file:
            status = os.fstat(handle)
            if not stat.S_ISREG(status.st_mode):
                raise InputError(f"{path}: is not a regular file")
            if status.st_size > at_most:
                raise InputError(f"{path}: {status.st_size} bytes; expected a text of at most {at_most}")
            return file.read(at_most).decode("utf-8-sig")
    except OSError as failure:
        raise InputError(f"{path}: {failure.strerror or failure}") from None
    except UnicodeDecodeError as failure:
        raise InputError(f"{path}: not UTF-8 text (byte {failure.start})") from None


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    with atomic_output(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def check_writable(path: Path) -> None:
    """Raise InputError now if an output file could not be written later.

    Checked before long work, so that it is not lost for a misspelt folder.
    """
    if path.is_dir():
        raise InputError(f"{path}: cannot write: it is a folder")
    if not path.parent.is_dir():
        raise InputError(f"{path}: cannot write: {path.parent} is not a folder")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise InputError(f"{path}: cannot write: no permission to write to {path.parent}")


def sha256_of(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's bytes.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as failure:
        raise InputError(f"{path}: cannot read: {failure.strerror or failure}") from None
