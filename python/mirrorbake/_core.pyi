"""Compiled part of mirrorbake. Use it through the package `mirrorbake`."""



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
