"""Parameterized environment maps: on disk, opened, drawn."""

from mirrorbake.pem.header import Header, Source
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.render import render
from mirrorbake.pem.run_time import RunTime
from mirrorbake.pem.store import PemStore, Timings
from mirrorbake.pem.view_images import ViewImages

__all__ = [
    "Header",
    "OpenedPem",
    "PemStore",
    "RunTime",
    "Source",
    "Timings",
    "ViewImages",
    "open_pem",
    "render",
]
