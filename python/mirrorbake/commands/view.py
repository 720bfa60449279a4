"""`mirrorbake view`."""

from __future__ import annotations

from typing import Annotated

import typer

from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Folder
from mirrorbake.commands.progress import messages


@reports_errors
def view_command(
    directory: Folder,
    port: Annotated[
        int,
        typer.Option("--port", min=0, max=65535, metavar="N", help="Port on this machine; 0: a free one."),
    ] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    """Show a PEM in the browser until interrupted; this machine alone can reach the page."""
    import webbrowser

    from mirrorbake.pem.export.source import export_source
    from mirrorbake.pem.export.web import WebOptions, WebPem
    from mirrorbake.pem.opened import open_pem
    from mirrorbake.viewer.server import Content, make_server

    source = export_source(open_pem(directory))
    server = make_server(Content(WebPem(source, WebOptions(trim=False)), source.title), port)
    url = f"http://127.0.0.1:{server.server_port}/"
    typer.echo(url)
    messages.print("Ctrl+C ends it", markup=False)
    if browser:
        webbrowser.open(url)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        pass
    finally:
        server.server_close()
