"""Compiled part of mirrorbake. Use it through the package `mirrorbake`."""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


class InvalidArgument(ValueError):
    pass

class FileError(OSError):
    pass

class NumericalError(ArithmeticError):
    pass

def version() -> str:
    """Version of the compiled library, 'MAJOR.MINOR.PATCH'."""

def thread_count() -> int:
    """Number of threads that parallel loops use now."""

class ThreadLimit:
    """
    While it lives, the library uses at most `threads` threads (0: all cores).
    """

    def __init__(self, threads: int) -> None: ...

class SaveReport:
    """What a file format could not hold."""

    @property
    def clamped_to_half(self) -> int:
        """
        Number of values beyond ±65504 that were clamped because the file stores float16.
        """

    @property
    def clipped(self) -> int:
        """
        Number of values outside [0,1] (in HDR: below 0), or NaN, that were clipped.
        """

    def __repr__(self) -> str: ...

def load_image(path: str) -> tuple[NDArray[numpy.float32], list[str]]:
    """
    Read an EXR, HDR, TIFF, PNG or JPEG as scene-linear float32 of shape (height, width, channels), with the
    names of the channels. Integer formats are decoded from sRGB. Raises FileError.
    """

def save_image(path: str, pixels: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], channels: Sequence[str] | None = None, format: str = 'automatic') -> SaveReport:
    """
    Write scene-linear pixels of shape (height, width, channels) atomically; the extension of the path decides the
    format. `channels` names the channels (default Y, YA, RGB or RGBA). `format`: automatic, half, float32, uint8
    or uint16. Raises FileError and InvalidArgument.
    """
