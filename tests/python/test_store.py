from __future__ import annotations

import contextlib
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
from mirrorbake.pem.schema import checksum_of
from mirrorbake.pem.shells import Part, Shell
from mirrorbake.pem.store import GROUP_NAME, Contents, PemStore, SolverReport, Timings, exclusive
from mirrorbake.pem.verify import verify
from mirrorbake.pem.view_images import ViewImages
from mirrorbake.scene.config_shells import ShellRule
from mirrorbake.scene.parameters import Axis, ParameterSpace
from mirrorbake.scene.plan import Decision, Plan

VIEWS, SIZE, WIDTH, HEIGHT = 3, 8, 6, 4
TEXELS = 6 * (64 + 16 + 4 + 1)
LID_SIZE, LID_TEXELS = 4, 6 * (16 + 4 + 1)
# Rounding to float16: half a unit in the last of 11 bits, of values below 1; the residual adds its own.
HALF_ROUNDING = 2.0**-11


CONFIG = {"maps": {"size": SIZE}, "reflector": {"mesh": "/a/cow.obj"}, "views": {"kind": "arc"}}


def make_plan(samples: int = 4) -> Plan:
    values: dict[str, Any] = {
        "reflector.parts": "split", "trace.depth": 2, "trace.samples": samples, "trace.noise": 0.02,
        "layers.diffuse": False,
        "shells": [{"name": "local", "objects": ["itself"]}, {"name": "distant"}],
        "layers.local": True, "layers.hull_split": False, "maps.distant": "infinite", "maps.size": SIZE,
        "views.traced": 0, "views.around": 0, "infer.passes": 2, "infer.neighbours": 0.3, "static.views": 0,
        "maps.shared_distant": False,
    }  # fmt: skip
    decisions = (Decision(key, None, value, True, "measured", 0.25) for key, value in values.items())
    return Plan(tuple(decisions), {"shape": "infinite", "origin": [0.0, 0.0, 0.0]})


def make_header(**changes: Any) -> Header:
    proxy: dict[str, Any] = {"shape": "infinite", "origin": [0.0, 0.0, 0.0]}
    distant = Shell("distant", proxy, "body/distant", SIZE, "all", moves=False)
    header = Header(
        source=Source(
            "1.2.3",
            {"maps": {"size": SIZE}, "reflector": {"mesh": "/a/cow.obj"}, "views": {"kind": "arc"}},
            {},
        ),
        plan=make_plan(),
        space=ParameterSpace((Axis("arc", (0.0, 0.5, 1.0), 0.0, 1.0),)),
        rules=(ShellRule(name="local", objects=("itself",)), ShellRule(name="distant")),
        parts=(
            Part("body", (Shell("local", proxy, "body/local", SIZE, "all", moves=True), distant)),
            Part("lid", (dataclasses.replace(distant, map="lid/distant", size=LID_SIZE),)),
        ),
        static={"infinite": proxy, "proxy": None, "fade": None},
        projection="cube",
        map_size=SIZE,
        precision="float16",
        image_size=(WIDTH, HEIGHT),
        origin=(1e5, 0.25, -3.0),
        run_time={"name": "reference", "lookups": 4, "footprint_scale": 0.25},
    )
    return dataclasses.replace(header, **changes)


def make_view(seed: int) -> tuple[dict[tuple[str, str], np.ndarray], ViewImages]:
    random = np.random.default_rng(seed)
    maps = {
        ("body", "local"): random.random((TEXELS, 4), np.float32),
        ("body", "distant"): random.random((TEXELS, 3), np.float32),
        ("lid", "distant"): random.random((LID_TEXELS, 3), np.float32),
    }
    images = ViewImages(
        object=random.random((HEIGHT, WIDTH, 3), np.float32),
        coverage=np.round(random.random((HEIGHT, WIDTH), np.float32) * 16).astype(np.float32)
        / np.float32(16),
        background=random.random((HEIGHT, WIDTH, 3), np.float32),
    )
    return maps, images


def make_contents(**changes: Any) -> Contents:
    capture = np.random.default_rng(9).random((6, SIZE, SIZE, 3), np.float32)
    return Contents(make_header(**changes), capture, None, np.ones(12, np.uint8))


def make_store(directory: Path | str, **changes: Any) -> PemStore:
    return PemStore.create(directory, make_contents(**changes))


def fill(store: PemStore) -> None:
    for index in range(VIEWS):
        store.write_view(index, *make_view(index), Timings(1.0, 2.0, 3.0), REPORTS)


REPORTS = {
    ("body", "local"): SolverReport(7, 1e-4, True),
    ("body", "distant"): SolverReport(200, 0.5, False),
}


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
    assert attributes["format_version"] == 7
    sizes = attributes["conventions"]["level_sizes"]
    assert sizes == [8, 4, 2, 1]
    names = [entry["name"] for entry in attributes["maps"]]
    assert names == ["body/local", "body/distant", "lid/distant"]
    texels = np.asarray(group["maps"][1, names.index("body/local")], np.float32)
    expected = make_view(1)[0]["body", "local"]
    level, offset = texels[: 6 * 64].reshape(6, 8, 8, 4), 6 * 64
    for size in sizes[1:]:
        level = level.reshape(6, size, 2, size, 2, 4).mean(axis=(2, 4))
        rows = slice(offset, offset + 6 * size * size)
        values = level.reshape(-1, 4) + texels[rows]
        np.testing.assert_allclose(values, expected[rows], rtol=0, atol=HALF_ROUNDING)
        offset += 6 * size * size
    # An opaque map beside one with α is opaque in it, too.
    assert (np.asarray(group["maps"][1, names.index("lid/distant")])[:LID_TEXELS, 3] == 1).all()
    assert not np.asarray(group["maps"][1, names.index("lid/distant")])[LID_TEXELS:].any()
    record = dict(zip(attributes["record"], np.asarray(group["record"][1]), strict=True))
    assert record["trace_s"] == 1.0
    assert (record["iterations: body/local"], record["converged: body/local"]) == (7, 1)
    assert (record["gradient: body/distant"], record["converged: body/distant"]) == (0.5, 0)


def files_of(directory: Path) -> set[Path]:
    return {path for path in directory.rglob("*") if path.is_file()}


def test_a_sample_is_three_objects_and_its_record_is_written_last(tmp_path: Path) -> None:
    store = make_store(tmp_path)
    before = files_of(tmp_path)
    store.write_view(1, *make_view(1), Timings(1.0, 2.0, 3.0))
    new = files_of(tmp_path) - before
    assert {path.relative_to(tmp_path / GROUP_NAME).parts[:3] for path in new} == {
        (name, "c", "1") for name in ("maps", "reference", "record")
    }
    assert len(new) == 3
    record = tmp_path / GROUP_NAME / "record" / "c" / "1" / "0"
    assert all(path.stat().st_mtime_ns <= record.stat().st_mtime_ns for path in new)
    assert store.completed().tolist() == [False, True, False]
    assert store.sample_bytes(1) == sum(path.stat().st_size for path in new)
    with pytest.raises(StoreError, match="only 1 of 3 samples are baked"):
        store.require_complete()


def test_a_write_that_is_killed_does_not_look_complete(tmp_path: Path) -> None:
    make_store(tmp_path)
    # The process dies in the middle of its second sample, after the maps and before the images.
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


def test_overwriting_a_sample_takes_its_record_away_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = make_store(tmp_path)
    fill(store)

    def fail(*arguments: Any) -> Any:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mirrorbake.pem.layout.split_pyramid", fail)
    with pytest.raises(StoreError, match="No space left"):
        store.write_view(2, *make_view(2), Timings(1.0, 2.0, 3.0))
    assert store.completed().tolist() == [True, True, False]


def test_two_writers_of_a_sample_write_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        fill(make_store(tmp_path / name))
    a, b = (
        {path.relative_to(tmp_path / name): path.read_bytes() for path in files_of(tmp_path / name)}
        for name in ("a", "b")
    )
    assert a == b
    fill(PemStore.open(tmp_path / "a", writable=True))
    assert {path.relative_to(tmp_path / "a"): path.read_bytes() for path in files_of(tmp_path / "a")} == a


def test_who_comes_second_to_create_a_pem_opens_the_first_ones(tmp_path: Path) -> None:
    fill(make_store(tmp_path))
    again = make_store(tmp_path)
    assert again.completed().all()
    assert [path.name for path in tmp_path.iterdir()] == [GROUP_NAME]


def test_references_beyond_float16_are_clamped_and_counted_or_kept(tmp_path: Path) -> None:
    maps, images = make_view(0)
    bright = dataclasses.replace(images, object=images.object * np.float32(1e6))
    (tmp_path / "half").mkdir()
    (tmp_path / "full").mkdir()
    half = make_store(tmp_path / "half")
    expected = int((bright.object > 65504).sum())
    assert expected > 0
    assert half.write_view(0, maps, bright, Timings(1, 2, 3)) == expected
    assert half.read_record(0)["clamped_reference"] == expected
    assert half.read_images(0).object.max() == 65504
    full = make_store(tmp_path / "full", precision="float32")
    assert full.write_view(0, maps, bright, Timings(1, 2, 3)) == 0
    np.testing.assert_array_equal(full.read_images(0).object, bright.object)


def test_creation_that_fails_leaves_no_pem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: Any) -> Any:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mirrorbake.pem.layout._make", fail)
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


def test_damaged_metadata_is_one_clear_error(tmp_path: Path) -> None:
    fill(make_store(tmp_path))
    metadata = tmp_path / GROUP_NAME / "zarr.json"
    intact = metadata.read_text()
    for broken in ("", "{", intact[: len(intact) // 2], "[]", "null", '{"zarr_format": 3}'):
        metadata.write_text(broken)
        with pytest.raises(StoreError, match="damaged, or not a PEM"):
            PemStore.open(tmp_path)
    for version, advice in ((99, ""), (2, "bake it anew")):
        other = json.loads(intact)
        other["attributes"]["mirrorbake"]["format_version"] = version
        metadata.write_text(json.dumps(other))
        with pytest.raises(StoreError, match=f"format version {version}, this library reads 7.*{advice}"):
            PemStore.open(tmp_path)


HOSTILE: tuple[Any, ...] = (
    None,
    -1,
    0,
    2**63,
    1e300,
    float("nan"),
    True,
    "",
    "../../etc",
    [],
    {},
    [[]],
    {"shape": "box"},
)


def test_any_edit_of_the_attributes_is_one_clear_error(tmp_path: Path) -> None:
    make_store(tmp_path)
    metadata = tmp_path / GROUP_NAME / "zarr.json"
    intact = json.loads(metadata.read_text())
    random = np.random.default_rng(5)
    places = list(leaves(intact["attributes"]["mirrorbake"]))
    tried = 0
    for number in range(120):
        path = places[random.integers(len(places))]
        edited = json.loads(json.dumps(intact))
        holder: Any = edited["attributes"]["mirrorbake"]
        for step in path[:-1]:
            holder = holder[step]
        value = HOSTILE[number % len(HOSTILE)]
        if type(holder[path[-1]]) is type(value) and holder[path[-1]] == value:
            continue
        if number % 4 == 0 and isinstance(holder, dict):
            del holder[path[-1]]
        else:
            holder[path[-1]] = value
        # Half of the edits come with the checksum that fits them: then the schema has to find them, or the
        # fingerprint, unless they are values that might be.
        if number % 2:
            attributes = edited["attributes"]["mirrorbake"]
            attributes["checksum"] = checksum_of(attributes)
        metadata.write_text(json.dumps(edited))
        tried += 1
        if number % 2:
            opens_or_says_why(tmp_path)
        else:
            with pytest.raises(StoreError) as caught:
                PemStore.open(tmp_path)
            assert "\n" not in str(caught.value)
    assert tried > 75


def opens_or_says_why(directory: Path) -> None:
    # Anything but a StoreError fails the test.
    with contextlib.suppress(StoreError):
        verify(directory)


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Any:
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from leaves(inner, (*path, key))


def test_hostile_arrays_are_refused_before_they_are_read(tmp_path: Path) -> None:
    fill(make_store(tmp_path))
    metadata = tmp_path / GROUP_NAME / "maps" / "zarr.json"
    intact = metadata.read_text()
    for key, value in (
        ("shape", [3, 3, 510, 10**15]),
        ("shape", [-1, 3, 510, 4]),
        ("shape", [3]),
        ("shape", "many"),
        ("data_type", "float64"),
        ("data_type", "string"),
        ("codecs", []),
        ("codecs", [{"name": "../../x"}]),
        ("chunk_grid", {"name": "regular", "configuration": {"chunk_shape": [1, 1, 1, 1]}}),
    ):
        edited = json.loads(intact)
        edited[key] = value
        metadata.write_text(json.dumps(edited))
        with pytest.raises(StoreError, match="damaged"):
            PemStore.open(tmp_path).read_map("body", "local", 0)
        assert verify(tmp_path).damaged == (0, 1, 2)


def test_every_flipped_bit_and_every_lost_object_is_found(tmp_path: Path) -> None:
    fill(make_store(tmp_path))
    assert verify(tmp_path).is_sound
    random = np.random.default_rng(3)
    chunks = sorted(path for path in files_of(tmp_path / GROUP_NAME) if path.name != "zarr.json")
    # Shared arrays, and three objects for each of three samples.
    assert len(chunks) == 2 + 9
    for number in range(44):
        path = chunks[number % len(chunks)]
        content = path.read_bytes()
        damaged = bytearray(content)
        if number < 33:
            damaged[random.integers(len(content))] ^= 1 << random.integers(8)
            path.write_bytes(damaged)
        elif number % 2:
            path.write_bytes(content[: random.integers(len(content))])
        else:
            path.unlink()
        verdict = verify(tmp_path)
        assert not verdict.is_sound, f"{path}, try {number}"
        assert len(verdict.problems) + len(verdict.missing) == 1
        assert all("damaged" in problem for problem in verdict.problems)
        path.write_bytes(content)
    assert verify(tmp_path).is_sound


def test_parts_may_share_a_map(tmp_path: Path) -> None:
    header = make_header()
    body, lid = header.parts
    shared = dataclasses.replace(body.shells[-1], map="shared distant")
    parts = (
        dataclasses.replace(body, shells=(body.shells[0], shared)),
        dataclasses.replace(lid, shells=(shared,)),
    )
    store = make_store(tmp_path, parts=parts)
    assert [entry.name for entry in store.header.maps] == ["body/local", "shared distant"]
    maps, images = make_view(1)
    maps["lid", "distant"] = maps["body", "distant"]
    store.write_view(1, maps, images, Timings(1.0, 2.0, 3.0), REPORTS)
    np.testing.assert_array_equal(store.read_map("body", "distant", 1), store.read_map("lid", "distant", 1))
    assert PemStore.open(tmp_path).header == store.header


def test_a_pem_lies_on_an_object_store_as_on_a_disk(tmp_path: Path) -> None:
    url = f"memory://pem-{tmp_path.name}"
    with pytest.raises(StoreError, match="holds no PEM"):
        PemStore.open(url)
    fill(make_store(url))
    fill(make_store(tmp_path))
    assert verify(url).is_sound
    for name in make_header().map_names():
        np.testing.assert_array_equal(
            PemStore.open(url).read_map(*name, 2), PemStore.open(tmp_path).read_map(*name, 2)
        )
    with pytest.raises(StoreError, match="is a URL"):
        _ = PemStore.open(url).directory


def test_a_pem_is_read_from_a_web_server(tmp_path: Path) -> None:
    # Other processes import this file without the folder of the helpers.
    from web_server import served

    fill(make_store(tmp_path))
    with served(tmp_path) as url:
        store = PemStore.open(url)
        np.testing.assert_array_equal(
            store.read_map("lid", "distant", 1), PemStore.open(tmp_path).read_map("lid", "distant", 1)
        )


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
    changed = json.loads(text.replace('"value": 4', '"value": 8'))
    attributes = changed["attributes"]["mirrorbake"]
    assert attributes != json.loads(text)["attributes"]["mirrorbake"]
    path.write_text(json.dumps(changed))
    with pytest.raises(StoreError, match="do not match their checksum"):
        PemStore.open(tmp_path)
    attributes["checksum"] = checksum_of(attributes)
    path.write_text(json.dumps(changed))
    with pytest.raises(StoreError, match="does not match its fingerprint"):
        PemStore.open(tmp_path)


def test_a_plan_without_one_of_its_decisions_is_damaged() -> None:
    data = make_plan().to_dict()
    assert Plan.from_dict(data) == make_plan()
    del data["decisions"][0]
    with pytest.raises(KeyError, match=r"reflector\.parts"):
        Plan.from_dict(data)


@pytest.mark.parametrize("size", ["64", -4, 3, 1 << 20, 64.0, True])
def test_a_plan_with_a_lightmap_of_no_size_is_damaged(size: Any) -> None:
    plan = make_plan()
    own = tuple(decision for decision in plan.decisions if decision.key != "layers.diffuse")
    lit = Decision("layers.diffuse", None, True, True, "", None)
    lightmap = Decision("layers.lightmap", None, 64, True, "", None)
    good = dataclasses.replace(plan, decisions=(*own, lit, lightmap))
    assert Plan.from_dict(good.to_dict()).lightmap == 64
    bad = dataclasses.replace(plan, decisions=(*own, lit, dataclasses.replace(lightmap, value=size)))
    with pytest.raises(KeyError, match=r"layers\.lightmap"):
        Plan.from_dict(bad.to_dict())


def test_two_bakes_cannot_write_to_one_folder(tmp_path: Path) -> None:
    with exclusive(tmp_path), pytest.raises(StoreError, match="another bake is writing"), exclusive(tmp_path):
        pass
    with exclusive(tmp_path):
        pass
