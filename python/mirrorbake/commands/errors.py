"""What the commands share: errors become one line on stderr and an exit status."""

from __future__ import annotations

import functools
import sys
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import typer
from typer.core import TyperGroup

from mirrorbake.errors import EXIT_INTERRUPTED, EXIT_USAGE, answer_to

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

P = ParamSpec("P")
R = TypeVar("R")

# All that is wrong with arguments. Typer exports only this subclass, which older versions take from Click.
_CLICK_ERROR: Any = next(base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException")


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
        except BaseException as failure:
            answer = answer_to(failure)
            if answer is None:
                raise
            raise _fail(*answer) from None

    return wrapped


class OneLineErrors(TyperGroup):
    """The root of the command line: what is wrong with its arguments is one line, too."""

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        windows_expand_args: bool = True,
        **extra: Any,
    ) -> Any:
        """Run the command line and exit, as Typer does."""
        given = (args, prog_name, complete_var)
        if not standalone_mode:
            return super().main(*given, False, windows_expand_args, **extra)
        try:
            status = super().main(*given, False, windows_expand_args, **extra)
        except _CLICK_ERROR as failure:
            # Without arguments the message is the help, printed already.
            if type(failure).__name__ != "NoArgsIsHelpError":
                context = getattr(failure, "ctx", None)
                hint = "" if context is None else f" ({context.command_path} --help tells more)"
                _fail(failure.format_message() + hint, EXIT_USAGE)
            sys.exit(EXIT_USAGE)
        except typer.Abort:
            _fail("interrupted", EXIT_INTERRUPTED)
            sys.exit(EXIT_INTERRUPTED)
        sys.exit(status if isinstance(status, int) else 0)
