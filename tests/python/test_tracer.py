"""The ray tracer as Python sees it: shapes, ownership, options and errors. Its physics is tested in C++."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake._core import Camera, TraceOptions, Tracer, TracerOptions
from mirrorbake.envmap import EnvMap


def scene_with_ring() -> tuple[_core.Scene, int]:
    scene = _core.Scene()
    metal = _core.Material()
    metal.specular = True
    metal.albedo = (0.1, 0.1, 0.2)
    metal.fresnel = _core.Fresnel("schlick", r0=(0.9, 0.7, 0.5))
    grey = _core.Material()
    grey.albedo = (0.5, 0.5, 0.5)
    ring = scene.add_object("ring", _core.make_torus((0, 1, 0), 0.5, 0.3, 32), scene.add_material(metal))
    scene.add_object(
        "floor", _core.make_rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6)), scene.add_material(grey)
    )
    scene.add_rectangle_light((-0.5, 3, -0.5), (1, 0, 0), (0, 0, 1), (5, 5, 5))
    scene.set_environment(np.full((4, 8, 3), 0.25, np.float32))
    return scene, ring


CAMERA = Camera((0.4, 2.9, 1.6), (0, 1, 0), width=24, height=16)


@pytest.fixture(scope="module")
def tracer() -> Tracer:
    return Tracer(scene_with_ring()[0], TracerOptions(indirect="cached", cache_rays=16))


def test_camera_holds_its_arguments_and_rejects_nonsense() -> None:
    camera = Camera(eye=(0, 0, 2), target=(0, 0, 0), vertical_fov_degrees=30, width=10, height=20)
    assert camera.eye == (0, 0, 2)
    assert camera.target == (0, 0, 0)
    assert camera.up == (0, 1, 0)
    assert (camera.vertical_fov_degrees, camera.width, camera.height) == (30, 10, 20)
    assert camera == Camera((0, 0, 2), (0, 0, 0), vertical_fov_degrees=30, width=10, height=20)
    assert "width=10" in repr(camera)
    camera.width = 30
    assert camera.width == 30
    with pytest.raises(_core.InvalidArgument, match=r"camera\.up"):
        Camera((0, 1, 0), (0, 0, 0))
    with pytest.raises(ValueError, match=r"camera\.width"):
        Camera((0, 0, 1), (0, 0, 0), width=0)


def test_options_take_keywords_and_stay_writable() -> None:
    options = TraceOptions(samples_per_pixel=3, max_specular_depth=2, max_diffuse_depth=1, seed=9)
    assert (options.samples_per_pixel, options.max_specular_depth) == (3, 2)
    assert (options.max_diffuse_depth, options.seed) == (1, 9)
    options.samples_per_pixel = 5
    assert options.samples_per_pixel == 5
    made = TracerOptions(indirect="path", cache_rays=7, cache_bounces=2, seed=4)
    assert (made.indirect, made.cache_rays, made.cache_bounces, made.seed) == ("path", 7, 2, 4)
    assert TracerOptions().indirect == "cached"


def test_layers_and_samples_recompose_the_beauty(tracer: Tracer) -> None:
    options = TraceOptions(samples_per_pixel=8, seed=3)
    beauty = tracer.trace_beauty(CAMERA, options)
    assert beauty.shape == (16, 24, 3)
    assert beauty.dtype == np.float32
    trace = tracer.trace_layers(CAMERA, 0, options)
    assert trace.layers.shape == (16, 24, len(trace.channels))
    of_layers = trace.layers[..., [trace.channels.index(c) for c in "RGB"]]
    # The same terms added in another order.
    np.testing.assert_allclose(of_layers, beauty, rtol=1e-5, atol=1e-6)

    s = trace.samples
    assert (s.width, s.height, s.samples_per_pixel) == (24, 16, 8)
    assert len(s) == len(s.pixel) > 500
    coverage = np.bincount(s.pixel, minlength=16 * 24).reshape(16, 24) / 8
    np.testing.assert_array_equal(trace.layers[..., trace.channels.index("coverage")], coverage)
    local, distant = (np.asarray(shell.radiance) for shell in s.shells)
    sum_of_layers = s.diffuse + s.fresnel * (local[:, :3] + (1 - local[:, 3:]) * distant[:, :3])
    np.testing.assert_allclose(sum_of_layers, trace.sample_beauty, rtol=1e-6, atol=1e-7)


def test_several_reflectors_are_traced_in_one_call() -> None:
    scene, ring = scene_with_ring()
    ball = scene.add_object("ball", _core.make_sphere((1, 0.5, 0), 0.4, 24), scene.object_material(ring))
    tracer = Tracer(scene, TracerOptions(indirect="none"))
    options = TraceOptions(samples_per_pixel=4)
    together = tracer.trace_layers(CAMERA, [ring, ball], options)
    assert len(together) == 2
    for reflector, trace in zip((ring, ball), together, strict=True):
        assert len(trace.samples) > 20
        alone = tracer.trace_layers(CAMERA, reflector, options)
        np.testing.assert_array_equal(trace.samples.diffuse, alone.samples.diffuse)
        # The beauty adds the terms of the other reflector's samples in another order.
        np.testing.assert_allclose(trace.layers, alone.layers, rtol=1e-5, atol=1e-6)
    with pytest.raises(_core.InvalidArgument, match="reflectors"):
        tracer.trace_layers(CAMERA, [ring, ring], options)


def test_a_window_is_a_part_of_the_image(tracer: Tracer) -> None:
    options = TraceOptions(samples_per_pixel=2)
    assert options.window == [0, 0, 0, 0]
    whole = tracer.trace_beauty(CAMERA, options)
    options.window = [5, 3, 7, 9]
    np.testing.assert_array_equal(tracer.trace_beauty(CAMERA, options), whole[3:12, 5:12])
    with pytest.raises(_core.InvalidArgument, match="window"):
        tracer.trace_beauty(CAMERA, TraceOptions(window=[20, 0, 7, 9]))


def test_tracing_to_a_noise_says_what_it_reached(tracer: Tracer) -> None:
    trace = tracer.trace_beauty_to_noise(CAMERA, 0.05, TraceOptions(samples_per_pixel=2048))
    assert trace.image.shape == (16, 24, 3)
    assert not trace.image.flags.writeable
    assert 0 < trace.noise <= 0.05
    assert 16 <= trace.mean_samples_per_pixel < 2048
    assert trace.share_above == 0
    with pytest.raises(_core.InvalidArgument, match="noise"):
        tracer.trace_beauty_to_noise(CAMERA, 0.0)


def test_distances_alone_are_those_of_intersect(tracer: Tracer) -> None:
    random = np.random.default_rng(1)
    directions = random.normal(size=(1000, 3)).astype(np.float32)
    origins = np.broadcast_to(np.array([0.2, 2.0, 1.0], np.float32), directions.shape).copy()
    distance, hit, _ = tracer.intersect(origins, directions, [0])
    alone = tracer.intersect_distance(origins, directions, [0])
    assert 100 < (hit == 1).sum() < 900
    np.testing.assert_array_equal(alone[0], distance)
    np.testing.assert_array_equal(alone[1], hit)
    with pytest.raises(_core.InvalidArgument, match="directions"):
        tracer.intersect_distance(origins, directions[:-1])


def test_samples_are_read_only_views_that_outlive_their_trace(tracer: Tracer) -> None:
    trace = tracer.trace_layers(CAMERA, 0, TraceOptions(samples_per_pixel=2))
    n = len(trace.samples)
    shapes = {
        "pixel": (n,), "part": (n,), "triangle": (n,), "barycentric": (n, 2), "position": (n, 3),
        "normal": (n, 3), "reflection": (n, 3), "dposition_dx": (n, 3), "dposition_dy": (n, 3),
        "dreflection_dx": (n, 3), "dreflection_dy": (n, 3), "fresnel": (n, 3), "albedo": (n, 3),
        "diffuse": (n, 3),
    }  # fmt: skip
    for name, shape in shapes.items():
        array = getattr(trace.samples, name)
        assert array.shape == shape, name
        assert not array.flags.writeable, name
        assert array.__array_interface__["data"] == getattr(trace.samples, name).__array_interface__["data"]
    for shell in trace.samples.shells:
        assert (shell.radiance.shape, shell.hit_distance.shape) == ((n, 4), (n,)), shell.name
        assert not shell.radiance.flags.writeable
    assert [shell.name for shell in trace.samples.shells] == ["local", "distant"]
    position = trace.samples.position
    layers = trace.layers
    kept = position.copy(), layers.copy()
    del trace
    gc.collect()
    np.testing.assert_array_equal(position, kept[0])
    np.testing.assert_array_equal(layers, kept[1])


def test_visibility_has_geometry_and_no_light(tracer: Tracer) -> None:
    options = TraceOptions(samples_per_pixel=4, seed=11)
    visible = tracer.trace_visibility(CAMERA, 0, options)
    traced = tracer.trace_layers(CAMERA, 0, options).samples
    np.testing.assert_array_equal(visible.pixel, traced.pixel)
    np.testing.assert_array_equal(visible.reflection, traced.reflection)
    assert visible.diffuse.shape == (0, 3)
    assert visible.shells == []


def test_visibility_through_given_places_is_that_of_their_rays(tracer: Tracer) -> None:
    places = [(0.5, 0.5), (0.125, 0.75)]
    samples = tracer.trace_visibility(CAMERA, 0, places=places)
    assert samples.samples_per_pixel == 2
    again = tracer.trace_visibility(CAMERA, 0, TraceOptions(seed=7), places)
    np.testing.assert_array_equal(samples.position, again.position)  # nothing about them is random
    centres = tracer.trace_visibility(CAMERA, 0, places=places[:1])
    assert np.isin(np.asarray(centres.pixel), np.asarray(samples.pixel)).all()
    with pytest.raises(ValueError, match=r"places\[1\]"):
        tracer.trace_visibility(CAMERA, 0, places=[(0.5, 0.5), (1.0, 0.5)])


def test_capture_hides_objects(tracer: Tracer) -> None:
    options = TraceOptions(samples_per_pixel=1)
    cube = tracer.capture_cube((0, 1, 0), 8, [0, 1], options)
    assert cube.shape == (6, 8, 8, 3)
    # Only the sky is left below and around; the light hangs above.
    np.testing.assert_allclose(cube[[0, 1, 3, 4, 5]], 0.25, rtol=1e-6)
    assert cube[2].max() == 5
    with_floor = tracer.capture_cube(origin=(0, 1, 0), size=8, hidden=[0], options=options)
    assert (with_floor[3] != cube[3]).all()
    with pytest.raises(ValueError, match="hidden"):
        tracer.capture_cube((0, 1, 0), 8, [2], options)


def test_capture_in_any_projection_is_what_an_envmap_takes(tracer: Tracer) -> None:
    options = TraceOptions(samples_per_pixel=1)
    for projection, shape in [("dual_paraboloid", (2, 8, 8, 3)), ("latlong", (8, 16, 3))]:
        array = tracer.capture((0, 1, 0), projection, shape[-2], 8, [0, 1], options)
        assert array.shape == shape
        envmap = EnvMap.from_array(array, projection)
        # The sky is all there is in front and behind, the light hangs above.
        np.testing.assert_allclose(envmap.sample([[0, -1, 0.5], [0, -1, -0.5]]), 0.25, rtol=1e-6)
    with pytest.raises(ValueError, match="projection"):
        tracer.capture((0, 1, 0), "octahedron", 8, 8)


def test_intersect_reports_distance_object_and_normal(tracer: Tracer) -> None:
    origins = np.array([[2, 5, 2], [2, 5, 2]], np.float32)
    directions = np.array([[0, -2, 0], [0, 1, 0]], np.float32)
    distance, hit, normal = tracer.intersect(origins, directions)
    np.testing.assert_allclose(distance, [5, np.inf])
    np.testing.assert_array_equal(hit, [1, -1])
    np.testing.assert_allclose(normal, [[0, 1, 0], [0, 0, 0]])
    assert tracer.intersect(origins, directions, [1])[1].tolist() == [-1, -1]
    with pytest.raises(ValueError, match="directions"):
        tracer.intersect(origins, np.zeros((2, 3), np.float32))


def test_vertex_irradiance_has_a_value_per_vertex(tracer: Tracer) -> None:
    irradiance = tracer.vertex_irradiance(1, rays=64, seed=1)
    assert irradiance.shape == tracer.scene.object_mesh(1).positions.shape
    # A floor under the whole sky and a lamp: at least the sky's π/4, less what the ring hides.
    assert (irradiance > 0.7 * 0.25 * np.pi).all()


def test_scene_is_validated_and_kept(tracer: Tracer) -> None:
    assert tracer.scene.object_names == ["ring", "floor"]
    scene, _ = scene_with_ring()
    broken = scene.material(0)
    broken.albedo = (2, 0, 0)
    scene.set_material(0, broken)
    with pytest.raises(ValueError, match="albedo"):
        Tracer(scene)
    with pytest.raises(ValueError, match="reflector"):
        tracer.trace_layers(CAMERA, 1)
