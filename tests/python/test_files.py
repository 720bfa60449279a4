from __future__ import annotations

import contextlib
import hashlib
from typing import TYPE_CHECKING

import pytest

from mirrorbake.errors import InputError
from mirrorbake.files import atomic_output, check_writable, sha256_of, write_text

if TYPE_CHECKING:
    from pathlib import Path


def test_output_appears_only_when_it_is_complete(tmp_path: Path) -> None:
    target = tmp_path / "figures.json"
    target.write_text("old")
    with contextlib.suppress(ZeroDivisionError), atomic_output(target) as temporary:
        temporary.write_text("half")
        raise ZeroDivisionError
    assert target.read_text() == "old"
    write_text(target, "new")
    assert target.read_text() == "new"
    assert [path.name for path in tmp_path.iterdir()] == ["figures.json"]


def test_output_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.write_text("")
    write_text(tmp_path / "atomic", "")
    assert (tmp_path / "atomic").stat().st_mode == plain.stat().st_mode


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    target = tmp_path / "missing" / "a.png"
    with pytest.raises(InputError, match=r"a\.png: cannot write"), atomic_output(target):
        pass
    with pytest.raises(InputError, match="is not a folder"):
        check_writable(target)
    with pytest.raises(InputError, match="it is a folder"):
        check_writable(tmp_path)


def test_a_file_is_known_by_its_bytes(tmp_path: Path) -> None:
    path = tmp_path / "data"
    path.write_bytes(b"abc")
    # FIPS 180-2, appendix B.1: SHA-256 of "abc".
    assert sha256_of(path) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert sha256_of(path) == hashlib.sha256(b"abc").hexdigest()
    with pytest.raises(InputError, match="cannot read: No such file"):
        sha256_of(tmp_path / "nothing")
