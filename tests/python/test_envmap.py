"""Environment maps through Python: no copies, shapes, errors, and properties of random maps."""

import copy
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mirrorbake import _core
from mirrorbake.envmap import EnvMap, Resampler
from mirrorbake.literals import MipFilter, ResampleFilter, SampleFilter
from mirrorbake.projection import directions_from_points, points_from_directions, texel_directions

PROJECTIONS = ["cube", "dual_paraboloid", "sphere_map", "latlong", "angular", "fisheye:360"]


def noise(projection: str, size: int, seed: int = 0) -> EnvMap:
    faces = {"cube": (6,), "dual_paraboloid": (2,)}.get(projection, ())
    values = np.random.default_rng(seed).random((*faces, size, size, 3), np.float32)
    return EnvMap.from_array(values, projection)


def test_a_map_is_a_view_of_the_array_it_was_made_from() -> None:
    array = np.zeros((6, 4, 4, 3), np.float32)
    envmap = EnvMap.from_array(array, "cube")
    array[2, 1, 3, 0] = 5.0
    assert envmap.level(0)[2, 1, 3, 0] == 5.0
    assert np.shares_memory(envmap.level(0), array)
    mips = envmap.mips()
    assert np.shares_memory(mips.level(2), mips.values)


def test_shapes_that_fit_no_projection_are_refused() -> None:
    with pytest.raises(ValueError, match=r"expected \(6, height, width, channels\)"):
        EnvMap.from_array(np.zeros((4, 8, 3)), "cube")
    with pytest.raises(ValueError, match="faces of a cube map are square"):
        EnvMap.from_array(np.zeros((6, 4, 8, 3)), "cube")
    with pytest.raises(ValueError, match="expected cube, dual_paraboloid"):
        EnvMap.from_array(np.zeros((4, 8, 3)), "mercator")
    with pytest.raises(IndexError, match="level is 1"):
        noise("cube", 4).level(1)


@settings(max_examples=30, deadline=None)
@given(
    source=st.sampled_from(PROJECTIONS),
    target=st.sampled_from(PROJECTIONS),
    source_size=st.integers(1, 20),
    target_size=st.integers(1, 20),
    filter=st.sampled_from(["automatic", "area", "bilinear", "nearest"]),
    seed=st.integers(0, 1000),
)
def test_resampling_stays_within_the_range_of_the_source(
    source: str, target: str, source_size: int, target_size: int, filter: ResampleFilter, seed: int
) -> None:
    envmap = noise(source, source_size, seed)
    result = envmap.resample(target, (target_size, target_size), filter=filter)
    assert result.values.min() >= envmap.values.min() - 1e-6
    assert result.values.max() <= envmap.values.max() + 1e-6


def test_a_resampler_gives_the_same_bits_as_resampling() -> None:
    maps = [noise("latlong", 32, seed) for seed in range(3)]
    resampler = Resampler(maps[0], "dual_paraboloid", (20, 21), filter="area")
    assert resampler.bytes > 0
    for envmap in maps:
        result = resampler.apply(envmap)
        expected = envmap.resample("dual_paraboloid", (20, 21), filter="area")
        np.testing.assert_array_equal(result.values, expected.values)
        assert result.level().shape == (2, 20, 21, 3)
    one_channel = EnvMap.from_array(maps[0].level()[..., :1], "latlong")
    np.testing.assert_array_equal(resampler.apply(one_channel).values, resampler.apply(maps[0]).values[::3])
    with pytest.raises(ValueError, match="source is latlong of 31 x 31, expected latlong of 32 x 32"):
        resampler.apply(noise("latlong", 31))
    assert Resampler(maps[0].layout, "cube", 8, max_bytes=0).bytes == 0


def test_a_resampler_names_the_argument_that_it_cannot_use() -> None:
    layout = noise("latlong", 4).layout
    with pytest.raises(ValueError, match=r"source_from_target has shape \(4, 4\), expected \(3, 3\)"):
        Resampler(layout, "cube", 3, source_from_target=np.eye(4))
    with pytest.raises(ValueError, match="max_bytes is -1, expected 0 or more"):
        Resampler(layout, "cube", 3, max_bytes=-1)


@settings(max_examples=30, deadline=None)
@given(
    projection=st.sampled_from(PROJECTIONS),
    size=st.integers(1, 33),
    filter=st.sampled_from(["solid_angle", "seamless"]),
    seed=st.integers(0, 1000),
)
def test_every_mip_level_keeps_the_flux(projection: str, size: int, filter: MipFilter, seed: int) -> None:
    mips = noise(projection, size, seed).mips(filter)
    for level in range(1, mips.levels):
        np.testing.assert_allclose(mips.flux(level), mips.flux(0), rtol=1e-6)


@pytest.mark.parametrize("projection", ["cube", "dual_paraboloid", "latlong"])
@pytest.mark.parametrize("filter", ["nearest", "bilinear", "trilinear", "ewa"])
def test_lookups_find_the_direction_that_was_stored(projection: str, filter: SampleFilter) -> None:
    faces = {"cube": 6, "dual_paraboloid": 2}.get(projection, 1)
    stored = np.stack([texel_directions(projection, 64, 64, face) for face in range(faces)])
    envmap = EnvMap.from_array(stored if faces > 1 else stored[0], projection).mips("solid_angle")
    d = np.random.default_rng(2).normal(size=(500, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d = d[np.abs(d[:, 1]) < 0.9]  # around its poles a panorama's texels are slivers
    tiny = np.full_like(d, 1e-4)
    # Half the diagonal of a texel of 2/64, as an angle up to 0.07 in the panorama.
    np.testing.assert_allclose(envmap.sample(d, tiny, tiny, filter=filter), d, atol=0.08)


def test_lookups_refuse_what_has_no_answer() -> None:
    envmap = noise("cube", 4)
    with pytest.raises(ValueError, match="2 NaN, infinite or zero"):
        envmap.sample([[0.0, 0.0, 0.0], [np.nan, 0.0, 1.0], [1.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="ddx, ddy"):
        envmap.sample([1.0, 0, 0], filter="ewa")
    assert envmap.sample([1.0, 0, 0]).shape == (3,)
    assert envmap.sample(np.ones((2, 5, 3))).shape == (2, 5, 3)


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_maps_pickle_copy_and_are_arrays_and_pictures(projection: str) -> None:
    made = noise(projection, 8).mips() if projection == "cube" else noise(projection, 8)
    for again in (pickle.loads(pickle.dumps(made)), copy.copy(made), copy.deepcopy(made)):
        assert again.layout == made.layout
        assert again.channels == made.channels
        np.testing.assert_array_equal(again.values, made.values)
    np.testing.assert_array_equal(np.asarray(made), made.level())
    assert np.shares_memory(np.asarray(made), made.values)
    assert not np.shares_memory(np.array(made), made.values)
    assert np.asarray(made, np.float64).dtype == np.float64
    assert projection in repr(made)
    assert made._repr_png_().startswith(b"\x89PNG")


def test_levels_broadcast_to_the_directions_and_a_bias_adds_to_them() -> None:
    mips = EnvMap.from_array(np.zeros((6, 4, 4, 1), np.float32), "cube").mips()
    for level in range(3):
        mips.level(level)[:] = level
    directions = np.ones((2, 3, 3), np.float32)
    rows = mips.sample(directions, filter="trilinear", level=[[0.5], [1.5]])[..., 0]
    np.testing.assert_allclose(rows, [[0.5] * 3, [1.5] * 3])
    assert mips.sample([0, 0, 1], filter="trilinear", level=0.5, bias=0.75)[0] == 1.25
    with pytest.raises(_core.InvalidArgument, match=r"level has the shape \(5,\), expected .* \(2, 3\)"):
        mips.sample(directions, filter="trilinear", level=np.zeros(5))
    with pytest.raises(_core.InvalidArgument, match="level is given"):
        mips.sample(directions, level=0.0)
    with pytest.raises(_core.InvalidArgument, match="bias is nan"):
        mips.sample(directions, filter="trilinear", level=0.0, bias=float("nan"))


def test_borders_surround_the_faces() -> None:
    envmap = noise("latlong", 8)
    wide = envmap.with_border(2)
    assert wide.shape == (1, 12, 12, 3)
    np.testing.assert_array_equal(wide[0, 2:-2, 2:-2], envmap.level())
    np.testing.assert_array_equal(wide[0, 2:-2, :2], envmap.level()[:, -2:])


def test_seams_are_measured() -> None:
    envmap = EnvMap.from_array(np.arange(6, dtype=np.float32).reshape(6, 1, 1, 1), "cube")
    across, inside = envmap.seam()
    assert (across, inside) == (5.0, 0.0) or (across, inside) == (4.0, 0.0)
    assert envmap.resample("cube", 2, filter="nearest").mips().seam(1)[0] == 0.0


def test_files_come_back(tmp_path: Path) -> None:
    cube = noise("cube", 8)
    cube.save(tmp_path / "cross.exr", faces="cross", format="float32")
    again = EnvMap.load(tmp_path / "cross.exr")
    assert again.projection == "cube"
    assert again.channels == ["R", "G", "B"]
    np.testing.assert_array_equal(again.values, cube.values)
    report = cube.mips().save(tmp_path / "cube.ktx2")
    assert report.clamped_to_half == 0
    loaded = EnvMap.load(tmp_path / "cube.ktx2")
    assert loaded.levels == 4
    np.testing.assert_allclose(loaded.level(3)[..., :3], cube.mips().level(3), rtol=1e-3)
    with pytest.raises(OSError, match="does not exist"):
        EnvMap.load(tmp_path / "none.ktx2")


def test_conventions_go_there_and_back() -> None:
    panorama = noise("latlong", 8)
    for name in ("openexr", "mitsuba", "threejs"):
        there = panorama.to_convention(name)
        assert not np.array_equal(there.values, panorama.values)
        np.testing.assert_array_equal(there.from_convention(name).values, panorama.values)


def test_comparison_measures_known_differences() -> None:
    envmap = noise("cube", 4)
    result = EnvMap.from_array(envmap.level() + np.float32(0.5), "cube").compare(envmap)
    assert result.max_error == pytest.approx(0.5, abs=1e-6)
    assert result.mean_error == pytest.approx(0.5, abs=1e-6)
    assert result.rms_error == pytest.approx(0.5, abs=1e-6)
    assert result.flux_ratio > 1.0
    assert result.not_finite == 0
    assert result.relative_l2 == pytest.approx(0.5 / np.sqrt(1 / 3), rel=0.1)
    assert result.psnr == pytest.approx(6.0, abs=0.2)


def test_pixel_footprints() -> None:
    image = np.zeros((2, 2, 3), np.float32)
    image[:, 1, 0] = 1.0
    image[1, :, 1] = 3.0
    ddx, ddy = _core.quad_differentials(image)
    np.testing.assert_array_equal(ddx, [[1, 0, 0]] * 4)
    np.testing.assert_array_equal(ddy, [[0, 3, 0]] * 4)
    with pytest.raises(ValueError, match="expected 3"):
        _core.quad_differentials(np.zeros((2, 2, 4), np.float32))
    direction, right, down = _core.footprint_from_corners(
        (-0.1, 0.1, -1), (0.1, 0.1, -1), (0.1, -0.1, -1), (-0.1, -0.1, -1)
    )
    np.testing.assert_allclose(direction, (0, 0, -1), atol=1e-6)
    assert right[0] == pytest.approx(0.2, abs=3e-3)
    assert down[1] == pytest.approx(-0.2, abs=3e-3)
    # Turning the normal by an angle turns the reflection by twice that.
    turned = _core.reflected_differential((0, 0, -1), (0, 0, 1), (0, 0, 0), (0.01, 0, 0))
    np.testing.assert_allclose(turned, (0.02, 0, 0), atol=1e-6)


def test_half_is_what_numpy_rounds_to_but_for_what_it_cannot_hold() -> None:
    values = np.random.default_rng(4).normal(scale=1e3, size=(2, 5, 5, 4)).astype(np.float32)
    values[0, 0, 0] = [1e9, -1e9, 65504, 3e-8]
    half, clamped = EnvMap.from_array(values, "dual_paraboloid").half()
    assert clamped == 2
    np.testing.assert_array_equal(half, np.clip(values, -65504, 65504).astype(np.float16))
    again = EnvMap.from_array(half, "dual_paraboloid")
    np.testing.assert_array_equal(again.level(), half.astype(np.float32))
    mips = EnvMap.from_array(np.ones((6, 4, 4, 3), np.float32), "cube").mips()
    assert mips.half()[0].shape == mips.values.shape


@pytest.mark.skipif("MIRRORBAKE_TEST_DATA" not in os.environ, reason="MIRRORBAKE_TEST_DATA is not set")
@pytest.mark.parametrize("filter", ["area", "automatic"])
def test_the_flux_of_a_photograph_is_kept_between_any_two_projections(
    filter: ResampleFilter,
) -> None:
    panorama = EnvMap.load(Path(os.environ["MIRRORBAKE_TEST_DATA"]) / "workshop.exr")
    # About as many texels each.
    sizes = {"cube": 209, "dual_paraboloid": 362, "sphere_map": 512, "latlong": 362, "angular": 512}
    for source, source_size in sizes.items():
        before = panorama.resample(source, source_size, filter="area")
        for target, target_size in sizes.items():
            after = before.resample(target, target_size, filter=filter)
            np.testing.assert_allclose(
                after.flux(), before.flux(), rtol=1e-3, err_msg=f"{source} to {target}"
            )


@pytest.mark.parametrize(
    "toward",
    [(0.12, 0.1, 1.0), (0.1, 1.0, 0.07), (1.0, 1.0, 0.98), (1.0, 0.2, -0.99), (0.7, 0.6, 0.02)],
    ids=["rim", "pole", "corner", "edge", "equator"],
)
def test_the_flux_of_a_sun_is_kept_where_projections_are_singular(toward: tuple[float, float, float]) -> None:
    d = texel_directions("latlong", 512, 256)
    image = np.full((256, 512, 1), 0.5, np.float32)
    image[d @ (np.array(toward) / np.linalg.norm(toward)) > np.cos(np.radians(1.5))] = 2e3
    panorama = EnvMap.from_array(image, "latlong")
    # Some 25,000 texels each. The sun, of two to three of them across, has a third of the flux.
    sizes = {"cube": 64, "dual_paraboloid": 112, "sphere_map": 160, "latlong": 112, "angular": 160}
    # A few texels away from a panorama's pole, edges that are traced meet edges that are straight.
    limit = 1e-2 if toward == (0.1, 1.0, 0.07) else 1e-3
    for projection, size in sizes.items():
        converted = panorama.resample(projection, size)
        np.testing.assert_allclose(converted.flux(), panorama.flux(), rtol=limit, err_msg=f"to {projection}")
        # Back it is interpolated, across the edges of faces as well.
        back = converted.resample("latlong", 128)
        np.testing.assert_allclose(back.flux(), converted.flux(), rtol=2e-3, err_msg=f"from {projection}")


def test_wrong_shapes_and_sizes_are_named() -> None:
    cube = noise("cube", 4)
    for directions in ([1.0, 0.0], np.ones((2, 6)), 1.0):
        with pytest.raises(_core.InvalidArgument, match=r"directions has the shape .*expected \(\.\.\., 3\)"):
            cube.sample(directions)
        with pytest.raises(_core.InvalidArgument, match="directions has the shape"):
            points_from_directions("cube", directions)
    with pytest.raises(_core.InvalidArgument, match="ddx has the shape"):
        cube.sample([0.0, 0.0, 1.0], [0.0, 1.0], [0.0, 0.0, 1.0], filter="ewa")
    with pytest.raises(_core.InvalidArgument, match="points has the shape"):
        directions_from_points("cube", 0, [0.0, 0.0, 0.0])
    for size in (2.5, None, "a", (3,), (2, 2, 2), 10**12, (4.0, 4.0)):
        with pytest.raises(_core.InvalidArgument, match="size is"):
            cube.resample("cube", size)  # type: ignore[arg-type]
    assert cube.resample("cube", np.int64(2)).layout.width == 2  # type: ignore[arg-type]
