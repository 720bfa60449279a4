"""Errors that orchestration raises, beside those of the compiled library.

`mirrorbake._core` raises `InvalidArgument` (a `ValueError`), `FileError` (an `OSError`) and `NumericalError`
(an `ArithmeticError`). The command line answers 2 for options with values that they do not take, 3 for other
bad input and 4 for numerical failures.
"""

from __future__ import annotations

import contextlib
import sys
from typing import TYPE_CHECKING

from mirrorbake import _core

if TYPE_CHECKING:
    from collections.abc import Iterator

EXIT_USAGE = 2
EXIT_INPUT = 3
EXIT_NUMERICAL = 4
EXIT_INTERRUPTED = 130


class InputError(ValueError):
    """Something the user gave cannot be used; the message names it, its value and what was expected."""


class OptionError(InputError):
    """An option of the command line, or an argument that one sets, has a value that it does not take."""


class StoreError(InputError):
    """An output directory is not a PEM, is incomplete, or belongs to another scene file."""


def answer_to(failure: BaseException) -> tuple[str, int] | None:
    """Return the line and the exit status with which a program answers a failure; None: it is a bug."""
    match failure:
        case OptionError():
            status = EXIT_USAGE
        case InputError() | _core.InvalidArgument() | _core.MissingLibrary() | OSError():
            status = EXIT_INPUT
        case MemoryError():
            return "not enough memory for images and maps of this size", EXIT_INPUT
        case ArithmeticError():
            status = EXIT_NUMERICAL
        case KeyboardInterrupt():
            return "interrupted", EXIT_INTERRUPTED
        case _:
            return None
    return " ".join(str(failure).split()), status


@contextlib.contextmanager
def one_line_errors(program: str) -> Iterator[None]:
    """End a program with one line on stderr, and the exit status, where its input is bad."""
    try:
        yield
    except BaseException as failure:
        answer = answer_to(failure)
        if answer is None:
            raise
        print(f"{program}: error: {answer[0]}", file=sys.stderr)
        sys.exit(answer[1])
