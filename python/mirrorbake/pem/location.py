"""Where a PEM lies: a folder, or an object store behind a URL."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import os
import re
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import zarr.storage
from zarr.core.sync import sync

from mirrorbake.errors import InputError, StoreError
from mirrorbake.files import atomic_output

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from zarr.abc.store import Store

GROUP_NAME = "pem.zarr"
_URL = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)


@dataclass(frozen=True)
class Location:
    """A folder of the file system, or a URL that fsspec knows: `memory://`, `s3://`, `https://`."""

    text: str
    """As the user wrote it."""

    @staticmethod
    def of(place: Location | Path | str) -> Location:
        """Return a location."""
        return place if isinstance(place, Location) else Location(str(place))

    @property
    def is_remote(self) -> bool:
        """Whether it is a URL."""
        return _URL.match(self.text) is not None

    @property
    def path(self) -> Path:
        """The folder.

        Raises
        ------
        StoreError
            It is a URL.
        """
        if self.is_remote:
            raise StoreError(f"{self.text}: is a URL; expected a folder of this machine's file system")
        return Path(self.text)

    def __str__(self) -> str:
        return self.text

    def store(self, *, writable: bool, name: str = GROUP_NAME) -> Store:
        """Return the Zarr store of the PEM's group.

        Raises
        ------
        StoreError
            The URL is of a kind that is not installed, or not known.
        """
        if not self.is_remote:
            return zarr.storage.LocalStore(self.path / name, read_only=not writable)
        try:
            return zarr.storage.FsspecStore.from_url(
                f"{self.text.rstrip('/')}/{name}", read_only=not writable
            )
        # What it raises depends on the kind of URL: ImportError, ValueError, errors of cloud libraries.
        except Exception as failure:
            raise StoreError(
                f"{self.text}: cannot open: {failure} (URLs need `pip install mirrorbake[remote]`)"
            ) from None

    def joined(self, name: str) -> Location:
        """Return a file or folder within it."""
        return (
            Location(f"{self.text.rstrip('/')}/{name}") if self.is_remote else Location(str(self.path / name))
        )

    def read_bytes(self) -> bytes:
        """Return the content of the file that this is.

        Raises
        ------
        StoreError
            There is none, or it cannot be read.
        """
        try:
            if not self.is_remote:
                return self.path.read_bytes()
            system, name = self._file_system()
            return bytes(system.cat_file(name))
        # What it raises depends on the kind of URL.
        except Exception as failure:
            raise StoreError(f"{self.text}: cannot read: {failure}") from None

    def write_bytes(self, content: bytes) -> None:
        """Make the file that this is, complete or not at all, and the folder that it is in.

        Raises
        ------
        StoreError
            It cannot be written, as nothing behind `https://` can.
        """
        try:
            if self.is_remote:
                system, name = self._file_system()
                system.pipe_file(name, content)
                return
            self.path.parent.mkdir(exist_ok=True)
            with atomic_output(self.path) as temporary:
                temporary.write_bytes(content)
        except InputError as failure:  # says already that the file cannot be written
            raise StoreError(str(failure)) from None
        # As above; NotImplementedError has no words of its own.
        except Exception as failure:
            words = getattr(failure, "strerror", None) or str(failure)
            raise StoreError(f"{self.text}: cannot write: {words or 'such URLs are only read'}") from None

    def _file_system(self) -> tuple[Any, str]:
        """Return what fsspec has for a URL, and the name within it."""
        # An optional dependency, which URLs alone need.
        from fsspec.core import url_to_fs

        system, name = url_to_fs(self.text)
        return system, name

    def exists(self) -> bool:
        """Whether there is a PEM, complete or not."""
        if not self.is_remote:
            return (self.path / GROUP_NAME).is_dir()
        return has_key(self.store(writable=False), "zarr.json")

    def remove_stray_files(self) -> None:
        """Remove what a killed write left behind in a folder."""
        if not self.is_remote:
            for stray in (self.path / GROUP_NAME).rglob("*.partial"):
                stray.unlink(missing_ok=True)

    @property
    def partial_name(self) -> str:
        """A name for the group while it is made, which no other process uses."""
        return f".{GROUP_NAME}.{uuid.uuid4().hex}.partial"


def has_key(store: Store, key: str) -> bool:
    """Whether a store has an object."""
    return bool(sync(store.exists(key)))


def list_keys(store: Store, prefix: str) -> list[str]:
    """Return the keys of all objects whose key starts so."""

    async def collect() -> list[str]:
        return [key async for key in store.list_prefix(prefix)]

    return sync(collect())


def keys_there(store: Store, prefix: str, keys: Sequence[str]) -> list[bool]:
    """Which of some keys, which all start with `prefix`, a store has objects of."""
    listed = set(list_keys(store, prefix))
    if listed or isinstance(store, zarr.storage.LocalStore):
        return [key in listed for key in keys]

    async def ask() -> list[bool]:
        return await asyncio.gather(*(store.exists(key) for key in keys))

    # A web server lists nothing: it is asked for each.
    return sync(ask())


def delete_key(store: Store, key: str) -> None:
    """Remove an object, if it is there."""
    sync(store.delete(key))


def bytes_under(store: Store, prefix: str) -> int:
    """Size of all objects whose key starts so."""
    return sum(stored_bytes(store, key) for key in list_keys(store, prefix))


def stored_bytes(store: Store, key: str) -> int:
    """Size of an object in bytes."""
    size: Any = sync(store.getsize(key))
    return int(size)


@contextlib.contextmanager
def exclusive(directory: Path, *, shared: bool = False) -> Iterator[None]:
    """Hold a folder's lock, which ends with the process however it dies.

    Parameters
    ----------
    directory
        The folder.
    shared
        Allow others that hold it shared, too: bakes of single samples.

    Raises
    ------
    StoreError
        Another process holds it.
    """
    handle = os.open(directory, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StoreError(f"{directory}: another bake is writing to it") from None
        yield
    finally:
        os.close(handle)


def rename_unless_there(source: Path, target: Path) -> None:
    """Rename a folder, unless another process has put one there first."""
    try:
        source.rename(target)
    except OSError:
        # A folder that is not empty cannot be renamed over: another process was first.
        if not target.is_dir():
            raise
