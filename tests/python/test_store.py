from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from mirrorbake.errors import StoreError
from mirrorbake.pem.header import Header, Source
from mirrorbake.pem.pyramid import coarser_sizes, decimate, join_pyramid, residual_texels, split_pyramid
from mirrorbake.pem.store import GROUP_NAME, PemStore, Timings, exclusive
from mirrorbake.pem.view_images import ViewImages
from mirrorbake.scene.parameters import Axis, ParameterSpace
from mirrorbake.scene.plan import Decision, Plan

VIEWS, SIZE, WIDTH, HEIGHT = 3, 8, 6, 4
TEXELS = 6 * (64 + 16 + 4 + 1)
# Rounding to float16: half a unit in the last of 11 bits, of values below 1; the residual adds its own.
HALF_ROUNDING = 2.0**-11


def make_plan(samples: int = 4) -> Plan:
    values: dict[str, bool | int | str] = {
        "trace.depth": 2, "trace.samples": samples, "layers.diffuse": False,
        "layers.local": True, "layers.hull_split": False, "maps.distant": "infinite", "maps.size": SIZE,
    }  # fmt: skip
    decisions = (Decision(key, None, value, True, "measured", 0.25) for key, value in values.items())
    return Plan(tuple(decisions), {"shape": "infinite", "origin": [0.0, 0.0, 0.0]})


def make_header(**changes: Any) -> Header:
    proxy = {"shape": "infinite", "origin": [0.0, 0.0, 0.0]}
    header = Header(
        source=Source("1.2.3", {"maps": {"size": SIZE}, "reflector": {"mesh": "/a/cow.obj"}}, {}),
        plan=make_plan(),
        space=ParameterSpace((Axis("arc", (0.0, 0.5, 1.0), 0.0, 1.0),)),
        parts=[
            {"name": "body", "layers": {"local": proxy, "distant": proxy}},
            {"name": "lid", "layers": {"distant": proxy}},
        ],
        static={"infinite": proxy, "proxy": None},
        map_size=SIZE,
        precision="float16",
        image_size=(WIDTH, HEIGHT),
    )
    return dataclasses.replace(header, **changes)


def make_view(seed: int) -> tuple[dict[tuple[str, str], np.ndarray], ViewImages]:
    random = np.random.default_rng(seed)
    maps = {
        ("body", "local"): random.random((TEXELS, 4), np.float32),
        ("body", "distant"): random.random((TEXELS, 3), np.float32),
        ("lid", "distant"): random.random((TEXELS, 3), np.float32),
    }
    images = ViewImages(
        object=random.random((HEIGHT, WIDTH, 3), np.float32),
        coverage=np.round(random.random((HEIGHT, WIDTH), np.float32) * 16).astype(np.float32)
        / np.float32(16),
        background=random.random((HEIGHT, WIDTH, 3), np.float32),
    )
    return maps, images


def make_store(directory: Path, **changes: Any) -> PemStore:
    capture = np.random.default_rng(9).random((6, SIZE, SIZE, 3), np.float32)
    return PemStore.create(directory, make_header(**changes), capture, None)


def fill(store: PemStore) -> None:
    for index in range(VIEWS):
        store.write_view(index, *make_view(index), Timings(1.0, 2.0, 3.0))


def test_decimation_takes_the_mean_of_each_2x2_block() -> None:
    level = np.arange(6 * 4 * 4 * 2, dtype=np.float32).reshape(6, 4, 4, 2)
    expected = level.astype(np.float64).reshape(6, 2, 2, 2, 2, 2).mean(axis=(2, 4))
    np.testing.assert_array_equal(decimate(level), expected)


@pytest.mark.parametrize("size", [1, 2, 64])
@pytest.mark.parametrize("precision", ["float16", "float32"])
def test_a_pyramid_comes_back_to_the_rounding_of_its_storage(size: int, precision: str) -> None:
    texels = 6 * size * size + residual_texels(size)
    assert texels == sum(6 * s * s for s in [size, *coarser_sizes(size)])
    pyramid = np.random.default_rng(1).random((texels, 3), np.float32)
    finest, residuals, clamped = split_pyramid(pyramid, size, precision)
    assert finest.dtype == residuals.dtype == precision
    assert clamped == 0
    tolerance = HALF_ROUNDING if precision == "float16" else 1e-6
    np.testing.assert_allclose(join_pyramid(finest, residuals), pyramid, rtol=0, atol=tolerance)


def test_levels_that_are_decimations_have_no_residual() -> None:
    finest = np.random.default_rng(2).integers(0, 64, (6, 8, 8, 3)).astype(np.float32)
    levels = [finest]
    while levels[-1].shape[1] > 1:
        levels.append(decimate(levels[-1]))
    pyramid = np.concatenate([level.reshape(-1, 3) for level in levels])
    _, residuals, _ = split_pyramid(pyramid, 8, "float16")
    assert residuals.size == residual_texels(8) * 3
    assert not residuals.any()


def test_what_float16_cannot_hold_is_clamped_and_counted() -> None:
    pyramid = np.ones((30, 3), np.float32)
    pyramid[0] = 1e6
    finest, residuals, clamped = split_pyramid(pyramid, 2, "float16")
    assert clamped == 3
    assert np.isfinite(join_pyramid(finest, residuals)).all()
    assert finest.max() == 65504.0


def test_a_view_is_read_as_it_was_written(tmp_path: Path) -> None:
    fill(make_store(tmp_path))
    store = PemStore.open(tmp_path)
    store.require_complete()
    assert store.header == make_header()
    for index in range(VIEWS):
        maps, images = make_view(index)
        for (part, layer), pyramid in maps.items():
            np.testing.assert_allclose(
                store.read_map(part, layer, index), pyramid, rtol=0, atol=HALF_ROUNDING
            )
        back = store.read_images(index)
        np.testing.assert_array_equal(back.coverage, images.coverage)
        np.testing.assert_allclose(back.object, images.object, rtol=0, atol=HALF_ROUNDING)
        np.testing.assert_allclose(back.background, images.background, rtol=0, atol=HALF_ROUNDING)
        assert store.read_timings(index) == Timings(1.0, 2.0, 3.0)
    assert store.read_irradiance() is None


def test_the_maps_can_be_read_with_nothing_but_zarr(tmp_path: Path) -> None:
    fill(make_store(tmp_path))
    group: Any = zarr.open_group(tmp_path / GROUP_NAME, mode="r")
    attributes: Any = group.attrs["mirrorbake"]
    assert attributes["format_version"] == 3
    sizes = attributes["conventions"]["level_sizes"]
    assert sizes == [8, 4, 2, 1]
    finest = np.asarray(group["maps/body/local/finest"][1], np.float32)
    residuals = np.asarray(group["maps/body/local/residuals"][1], np.float32)
    expected = make_view(1)[0]["body", "local"]
    level, offset = finest, 0
    for size in sizes[1:]:
        level = level.reshape(6, size, 2, size, 2, 4).mean(axis=(2, 4))
        rows = slice(offset, offset + 6 * size * size)
        values = level.reshape(-1, 4) + residuals[rows]
        start = 6 * 64 + offset
        np.testing.assert_allclose(
            values, expected[start : start + 6 * size * size], rtol=0, atol=HALF_ROUNDING
        )
        offset += 6 * size * size
    assert group["maps/body/local/finest"].chunks == (1, 6, 8, 8, 4)


def test_each_view_is_a_chunk_of_its_own_and_its_mark_is_written_last(tmp_path: Path) -> None:
    store = make_store(tmp_path)
    before = {path for path in tmp_path.rglob("*") if path.is_file()}
    store.write_view(1, *make_view(1), Timings(1.0, 2.0, 3.0))
    new = [path for path in tmp_path.rglob("*") if path.is_file() and path not in before]
    mark = tmp_path / GROUP_NAME / "complete" / "c" / "1"
    assert mark in new
    assert all(path.stat().st_mtime_ns <= mark.stat().st_mtime_ns for path in new)
    assert store.completed().tolist() == [False, True, False]
    with pytest.raises(StoreError, match="only 1 of 3 views are baked"):
        store.require_complete()


def test_a_write_that_is_killed_does_not_look_complete(tmp_path: Path) -> None:
    make_store(tmp_path)
    # The process dies in the middle of its second view, after the maps and before the images.
    script = f"""
import os, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
import test_store
from mirrorbake.pem.store import PemStore, Timings
store = PemStore.open(Path({str(tmp_path)!r}), writable=True)
store.write_view(0, *test_store.make_view(0), Timings(1, 2, 3))
original = store._array
def array(name):
    if name.startswith("reference"):
        os.kill(os.getpid(), 9)
    return original(name)
store._array = array
store.write_view(1, *test_store.make_view(1), Timings(1, 2, 3))
"""
    result = subprocess.run([sys.executable, "-c", script], check=False)
    assert result.returncode == -9
    assert PemStore.open(tmp_path).completed().tolist() == [True, False, False]


def test_overwriting_a_view_takes_its_mark_away_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = make_store(tmp_path)
    fill(store)

    def fail(*arguments: Any) -> Any:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mirrorbake.pem.store.split_pyramid", fail)
    with pytest.raises(StoreError, match="No space left"):
        store.write_view(2, *make_view(2), Timings(1.0, 2.0, 3.0))
    assert store.completed().tolist() == [True, True, False]


def test_creation_that_fails_leaves_no_pem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: Any) -> Any:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mirrorbake.pem.store._put", fail)
    with pytest.raises(StoreError, match="No space left"):
        make_store(tmp_path)
    assert not PemStore.exists(tmp_path)
    monkeypatch.undo()
    fill(make_store(tmp_path))
    assert PemStore.open(tmp_path).completed().all()


def test_what_is_not_a_pem_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="holds no PEM"):
        PemStore.open(tmp_path)
    (tmp_path / GROUP_NAME).mkdir()
    with pytest.raises(StoreError, match="damaged, or not a PEM"):
        PemStore.open(tmp_path)


def test_damage_is_reported_with_the_place(tmp_path: Path) -> None:
    fill(make_store(tmp_path))
    metadata = tmp_path / GROUP_NAME / "zarr.json"
    intact = metadata.read_text()
    for broken in ("", "{", intact[: len(intact) // 2], intact.replace('"map_size"', '"map_sise"')):
        metadata.write_text(broken)
        with pytest.raises(StoreError, match="damaged, or not a PEM"):
            PemStore.open(tmp_path)
    newer = json.loads(intact)
    newer["attributes"]["mirrorbake"]["format_version"] = 99
    metadata.write_text(json.dumps(newer))
    with pytest.raises(StoreError, match="format version 99, this library reads 3"):
        PemStore.open(tmp_path)
    metadata.write_text(intact)
    store = PemStore.open(tmp_path)
    chunk = tmp_path / GROUP_NAME / "maps/lid/distant/finest/c/1/0/0/0/0"
    chunk.write_bytes(chunk.read_bytes()[:10])
    with pytest.raises(StoreError, match=r"damaged: maps/lid/distant/finest cannot be read"):
        store.read_map("lid", "distant", 1)
    store.read_map("lid", "distant", 0)


def test_the_fingerprint_follows_contents_and_not_places() -> None:
    config = {"reflector": {"mesh": "/a/cow.obj"}, "maps": {"size": 8}}
    moved = {"reflector": {"mesh": "/b/cow.obj"}, "maps": {"size": 8}}

    def source(config: dict[str, Any], digest: str, library: str = "1") -> Source:
        path = config["reflector"]["mesh"]
        return Source(library, config, {"reflector.mesh": {"path": path, "sha256": digest}})

    original = source(config, "00")
    assert source(moved, "00").fingerprint == original.fingerprint
    assert source(config, "11").fingerprint != original.fingerprint
    assert source(config, "11").difference_from(original) == "reflector.mesh: a file of other content"
    other = source({**config, "maps": {"size": 16}}, "00")
    assert other.fingerprint != original.fingerprint
    assert other.difference_from(original) == "maps.size = 8 instead of 16"
    assert source(config, "00", "2").difference_from(original) == "mirrorbake 1 instead of 2"


def test_the_fingerprint_covers_what_was_decided(tmp_path: Path) -> None:
    assert make_header().fingerprint == make_header().fingerprint
    assert make_header(plan=make_plan(samples=8)).fingerprint != make_header().fingerprint
    path = make_store(tmp_path).directory / GROUP_NAME / "zarr.json"
    text = path.read_text()
    changed = text.replace('"value": 4', '"value": 8')
    assert changed != text
    path.write_text(changed)
    with pytest.raises(StoreError, match="does not match its fingerprint"):
        PemStore.open(tmp_path)


def test_a_plan_without_one_of_its_decisions_is_damaged() -> None:
    data = make_plan().to_json()
    assert Plan.from_json(data) == make_plan()
    del data["decisions"][0]
    with pytest.raises(KeyError, match=r"trace\.depth"):
        Plan.from_json(data)


def test_two_bakes_cannot_write_to_one_folder(tmp_path: Path) -> None:
    with exclusive(tmp_path), pytest.raises(StoreError, match="another bake is writing"), exclusive(tmp_path):
        pass
    with exclusive(tmp_path):
        pass
