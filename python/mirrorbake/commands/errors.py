"""What the commands share: errors become one line on stderr and an exit status."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import typer

from mirrorbake import _core
from mirrorbake.errors import InputError, OptionError

if TYPE_CHECKING:
    from collections.abc import Callable

EXIT_USAGE = 2
EXIT_INPUT = 3
EXIT_NUMERICAL = 4
EXIT_INTERRUPTED = 130

P = ParamSpec("P")
R = TypeVar("R")


def _fail(text: str, status: int) -> typer.Exit:
    # One line whatever the text holds; rich would wrap it and read brackets as markup.
    typer.echo("mirrorbake: error: " + " ".join(text.split()), err=True)
    return typer.Exit(status)


def reports_errors(command: Callable[P, R]) -> Callable[P, R]:
    """Turn the errors of bad input into one line and an exit status."""

    @functools.wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return command(*args, **kwargs)
        except OptionError as failure:
            raise _fail(str(failure), EXIT_USAGE) from None
        except (InputError, _core.InvalidArgument, OSError) as failure:
            raise _fail(str(failure), EXIT_INPUT) from None
        except MemoryError:
            raise _fail("not enough memory for images and maps of this size", EXIT_INPUT) from None
        except ArithmeticError as failure:
            raise _fail(str(failure), EXIT_NUMERICAL) from None
        except KeyboardInterrupt:
            raise _fail("interrupted", EXIT_INTERRUPTED) from None

    return wrapped
