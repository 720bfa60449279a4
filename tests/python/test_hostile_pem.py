"""PEM folders that came from anywhere: what every command says of damaged and hostile ones."""

from __future__ import annotations

import json
import shutil
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from typer.testing import CliRunner

from mirrorbake.bake.bake import bake
from mirrorbake.commands.main import app
from mirrorbake.errors import EXIT_INPUT, InputError
from mirrorbake.pem.export.map_sets import sample_set
from mirrorbake.pem.export.maps import export_maps
from mirrorbake.pem.export.source import export_source
from mirrorbake.pem.export.web import WebOptions, WebPem
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.schema import checksum_of
from mirrorbake.pem.store import GROUP_NAME, PemStore
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from mirrorbake.scene.stage import Stage

SMALL: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 3, "parts": "split"},
    "material": {"ior": 1.5, "albedo": 0.3},
    "views": {"count": 2, "degrees": 2.0, "size": [24, 24]},
    "maps": {"size": 8, "distant": "infinite"},
    "layers": {"diffuse": True, "local": True, "hull_split": True},
    "trace": {"samples": 1, "indirect": "none"},
    "auto": {"quality": "draft"},
    "static": {"views": 2},
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("hostile") / "sound"
    bake(parse_config(SMALL, "small"), directory)
    return directory


@pytest.fixture
def pem(sound: Path, tmp_path: Path) -> Path:
    shutil.copytree(sound, tmp_path / "pem")
    return tmp_path / "pem"


def files_of(directory: Path) -> list[Path]:
    return sorted(path for path in (directory / GROUP_NAME).rglob("*") if path.is_file())


def run(*arguments: Any) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    # Whatever is not reported as an error of the input comes through as itself.
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.output.strip()


def draw(pem: Path) -> tuple[int, str]:
    return run("render", pem, "--view", "0.3", "--out", pem.parent / "picture.png")


@pytest.fixture(scope="module")
def serve(sound: Path) -> Callable[[Path], str]:
    """Make every file that `view` would send, and return what is said if that cannot be."""
    stage = open_pem(sound).stage
    return lambda pem: everything(pem, stage)


def everything(pem: Path, stage: Stage) -> str:
    try:
        web = WebPem(export_source(open_pem(pem, stage)), WebOptions(fallback=False))
        for name in web.names:
            web.read(name)
    except InputError as failure:
        return str(failure)
    return ""


def damages(path: Path, random: np.random.Generator) -> Iterator[tuple[str, bytes | None]]:
    content = path.read_bytes()
    flipped = bytearray(content)
    flipped[random.integers(len(content))] ^= 1 << random.integers(8)
    yield "flipped", bytes(flipped)
    yield "truncated", content[: random.integers(len(content))]
    yield "deleted", None


def test_every_damaged_file_is_one_clear_line_of_every_command(
    serve: Callable[[Path], str], pem: Path
) -> None:
    random = np.random.default_rng(11)
    assert (run("verify", pem)[0], draw(pem)[0], serve(pem)) == (0, 0, "")
    names = {path.relative_to(pem / GROUP_NAME).as_posix() for path in files_of(pem)}
    assert {"zarr.json", "maps/zarr.json", "static/maps/zarr.json", "local_triangles/c/0"} <= names
    for number, path in enumerate(files_of(pem)):
        content = path.read_bytes()
        # Of metadata two kinds of damage each, to be quick.
        kinds = [
            k for i, k in enumerate(damages(path, random)) if path.name != "zarr.json" or i != number % 3
        ]
        for kind, damaged in kinds:
            what = f"{path.relative_to(pem)} {kind}"
            if damaged is None:
                path.unlink()
            else:
                path.write_bytes(damaged)
            said = {"info": run("info", pem), "render": draw(pem), "verify": run("verify", pem)}
            for command, (status, line) in said.items():
                assert status in (0, EXIT_INPUT), f"{what}: {command}: {line}"
                if status != 0:
                    assert str(pem) in line, f"{what}: {command}: {line}"
            page = serve(pem)
            assert "\n" not in page
            # A flipped bit of metadata may leave what fits, such as the name of a dimension; of data nothing
            # goes unnoticed.
            if path.name == "zarr.json":
                pass
            elif path.relative_to(pem / GROUP_NAME).parts[0] != "record":
                assert said["verify"][0] == EXIT_INPUT, what
                assert page, what
            elif damaged is None:
                # Without its record a sample is one that is not baked yet.
                assert "1 not baked" in said["verify"][1], what
                assert "only 1 of 2 samples are baked" in page, what
            else:
                assert said["verify"][0] == EXIT_INPUT, what
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    assert (run("verify", pem)[0], draw(pem)[0], serve(pem)) == (0, 0, "")


def edited(metadata: Path, change: Callable[[dict[str, Any]], None]) -> None:
    described = json.loads(metadata.read_text())
    change(described)
    metadata.write_text(json.dumps(described))


ARRAYS = (
    "maps",
    "reference",
    "record",
    "diffuse/irradiance",
    "static/capture",
    "static/maps",
    "local_triangles",
)


@pytest.mark.parametrize("name", ARRAYS)
def test_wrong_huge_and_negative_shapes_are_one_clear_line(
    name: str, serve: Callable[[Path], str], pem: Path
) -> None:
    metadata = pem / GROUP_NAME / name / "zarr.json"
    intact = metadata.read_text()
    shape = json.loads(intact)["shape"]
    hostile: list[Any] = [
        [*shape[:-1], 10**15],
        [-1, *shape[1:]],
        [*shape, 2],
        [*shape[:-1], shape[-1] + 1],
        [*shape[:-1], max(shape[-1] - 1, 1) if shape[-1] > 1 else 2],
        "many",
        None,
    ]
    for wrong in hostile:
        metadata.write_text(intact)
        edited(metadata, lambda described, wrong=wrong: described.update(shape=wrong))  # type: ignore[misc]
        status, line = run("verify", pem)
        assert status == EXIT_INPUT, f"{name} {wrong}: {line}"
        assert "damaged" in line, f"{name} {wrong}: {line}"
        page = serve(pem)
        assert "damaged" in page or name == "record", f"{name} {wrong}"


def with_attributes(pem: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change the attributes and give them the checksum that fits."""

    def both(described: dict[str, Any]) -> None:
        attributes = described["attributes"]["mirrorbake"]
        change(attributes)
        attributes["checksum"] = checksum_of(attributes)

    edited(pem / GROUP_NAME / "zarr.json", both)


def test_names_that_climb_out_of_a_folder_stay_in_it(pem: Path, tmp_path: Path) -> None:
    names = ["../../body", "/etc/lid"]

    def rename(attributes: dict[str, Any]) -> None:
        for part, name in zip(attributes["parts"], names, strict=True):
            part["name"] = name

    with_attributes(pem, rename)
    store = PemStore.open(pem)
    assert [part.name for part in store.header.parts] == names
    out = tmp_path / "a" / "b" / "maps"
    before = set(tmp_path.rglob("*"))
    description = export_maps([sample_set(store, 0)], out)
    written = {path for path in set(tmp_path.rglob("*")) - before if path.is_file()}
    assert all(path.parent == out for path in written)
    files = [
        name
        for part in description["sets"][0]["parts"]
        for shell in part["shells"]
        for name in shell["files"]
    ]
    assert sorted(set(files)) == sorted(path.name for path in written if path.name != "maps.json")
    assert len(set(files)) == 4
    assert all("/" not in name and not name.startswith("..") for name in files)
    web = WebPem(export_source(open_pem(pem)), WebOptions(fallback=False))
    assert not [name for name in web.names if ".." in name.split("/") or name.startswith("/")]


def test_a_pem_of_format_2_says_how_to_bake_anew(serve: Callable[[Path], str], pem: Path) -> None:
    with_attributes(pem, lambda attributes: attributes.update(format_version=2))
    for status, line in (run("info", pem), draw(pem), run("verify", pem)):
        assert status == EXIT_INPUT
        assert "format version 2" in line
        assert "bake it anew with `mirrorbake bake SCENE.toml --out ANOTHER_DIR`" in line
    assert "bake it anew" in serve(pem)
