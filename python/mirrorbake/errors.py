"""Errors that orchestration raises, beside those of the compiled library.

`mirrorbake._core` raises `InvalidArgument` (a `ValueError`), `FileError` (an `OSError`) and `NumericalError`
(an `ArithmeticError`). The command line answers 2 for options with values that they do not take, 3 for other
bad input and 4 for numerical failures.
"""


class InputError(ValueError):
    """Something the user gave cannot be used; the message names it, its value and what was expected."""


class OptionError(InputError):
    """An option of the command line, or an argument that one sets, has a value that it does not take."""


class StoreError(InputError):
    """An output directory is not a PEM, is incomplete, or belongs to another scene file."""
