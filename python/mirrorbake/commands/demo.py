"""`mirrorbake demo`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Json, Threads, print_figures
from mirrorbake.commands.progress import messages, progress

if TYPE_CHECKING:
    from mirrorbake.bake.bake import ProgressReport


@reports_errors
def demo_command(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")] = Path(
        "out/demo"
    ),
    json: Json = False,
    threads: Threads = 0,
) -> None:
    """Bake and evaluate a small teapot scene: some minutes on two cores."""
    from mirrorbake.evaluate.demo import run_demo

    with _core.ThreadLimit(threads), progress() as add_bar:
        evaluation, sheet = run_demo(out, add_bar)
        page = _write_page(out, add_bar("page"))
    print_figures(evaluation, json)
    messages.print(f"wrote {sheet}", markup=False, soft_wrap=True)
    messages.print(page, markup=False, soft_wrap=True)


def _write_page(directory: Path, report: ProgressReport) -> str:
    """Write the page into the demonstration's folder; returns what there is to say about it."""
    from mirrorbake.pem.export.images import ImageFormat
    from mirrorbake.pem.export.source import export_source
    from mirrorbake.pem.export.web import WebOptions, WebPem
    from mirrorbake.pem.opened import open_pem
    from mirrorbake.viewer.export import PAGE_NAME, write_single_file
    from mirrorbake.viewer.page import is_built

    if not is_built():
        return "no page: script/bootstrap builds the viewer with Node.js 18 or newer"
    page = directory / "viewer" / PAGE_NAME
    page.parent.mkdir(exist_ok=True)
    source = export_source(open_pem(directory))
    options = WebOptions(ImageFormat(exact=False), fallback=False)
    size = write_single_file(WebPem(source, options), source.title, page, report)
    return f"wrote {page}, {size / 1e6:.2f} MB: open it in a browser"
