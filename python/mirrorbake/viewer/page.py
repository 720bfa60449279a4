"""The viewer's page: script and style sheet as `viewer/` builds them, and HTML around them."""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import TYPE_CHECKING

from mirrorbake.errors import InputError
from mirrorbake.viewer.text import text_of_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mirrorbake.pem.export.web import WebPem

PAGE_FOLDER = Path(__file__).parent / "page"
SCRIPT_NAME = "viewer.js"
STYLE_NAME = "viewer.css"

_HEAD = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title} – mirrorbake</title>
<link rel="icon" href="data:,">
"""
_NO_SCRIPT = "<noscript>This page needs JavaScript to draw.</noscript>\n"


def is_built() -> bool:
    """Whether the page has been built."""
    return (PAGE_FOLDER / SCRIPT_NAME).is_file()


def built_file(name: str) -> str:
    """Text of a built file of the page.

    Raises
    ------
    InputError
        The page has not been built.
    """
    try:
        return (PAGE_FOLDER / name).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(
            f"{PAGE_FOLDER}: the viewer's page has not been built (script/bootstrap builds it with Node.js)"
        ) from None


def page_beside_files(title: str) -> str:
    """HTML of a page whose script, style sheet and PEM lie beside it."""
    return (
        _HEAD.format(title=html.escape(title))
        + f'<link rel="stylesheet" href="{STYLE_NAME}">\n</head>\n<body>\n'
        + '<div id="viewer" data-data=""></div>\n'
        + _NO_SCRIPT
        + f'<script src="{SCRIPT_NAME}"></script>\n</body>\n</html>\n'
    )


def page_with_files(title: str, pem: WebPem) -> Iterator[str]:
    """HTML of a page that holds everything, piece by piece.

    The PEM's files follow the script in the order in which the page wants them, so that a browser that is
    still loading draws the first of them. Such a page also works from disk, where browsers read no other
    files.
    """
    script = built_file(SCRIPT_NAME).replace("</script", "<\\/script")
    yield _HEAD.format(title=html.escape(title))
    yield f"<style>{built_file(STYLE_NAME)}</style>\n</head>\n<body>\n"
    yield '<div id="viewer" data-data="embedded"></div>\n' + _NO_SCRIPT
    yield f"<script>{script}</script>\n"
    for name in pem.names:
        data = pem.read(name)
        yield f'<script>mirrorbakeFile({json.dumps(name)},{len(data)},"{text_of_bytes(data)}")</script>\n'
    yield "</body>\n</html>\n"
