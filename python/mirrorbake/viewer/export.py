"""Writing the page with a PEM: a folder for any web server, or one file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mirrorbake.errors import InputError
from mirrorbake.files import atomic_output, check_writable
from mirrorbake.viewer.page import (
    SCRIPT_NAME,
    STYLE_NAME,
    built_file,
    page_beside_files,
    page_with_files,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from mirrorbake.pem.export.web import WebPem

PAGE_NAME = "index.html"


def write_folder(pem: WebPem, title: str, folder: Path, report: Callable[[int, int, str], None]) -> int:
    """Write the page and the PEM's files into a folder, the page last. Returns the bytes written.

    Raises
    ------
    InputError
        The folder cannot be written to, or holds something else.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file, expected a folder")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / PAGE_NAME).is_file():
        raise InputError(f"{folder}: is not empty and holds no page; expected a new or an empty folder")
    files = {SCRIPT_NAME: built_file(SCRIPT_NAME), STYLE_NAME: built_file(STYLE_NAME)}
    total = 0

    def put(name: str, data: bytes) -> None:
        nonlocal total
        path = folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with atomic_output(path) as temporary:
                temporary.write_bytes(data)
        except OSError as failure:
            raise InputError(f"{path}: cannot write: {failure.strerror or failure}") from None
        total += len(data)

    names = pem.names
    for done, name in enumerate(names):
        report(done, len(names), name)
        put(name, pem.read(name))
    for name, text in files.items():
        put(name, text.encode())
    put(PAGE_NAME, page_beside_files(title).encode())
    report(len(names), len(names), f"{len(names)} files")
    return total


def write_single_file(pem: WebPem, title: str, path: Path, report: Callable[[int, int, str], None]) -> int:
    """Write the page with everything in it. Returns its bytes.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    check_writable(path)
    report(0, len(pem.names), path.name)
    with atomic_output(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        for done, piece in enumerate(page_with_files(title, pem)):
            file.write(piece)
            report(min(done, len(pem.names)), len(pem.names), path.name)
    report(len(pem.names), len(pem.names), path.name)
    return path.stat().st_size
