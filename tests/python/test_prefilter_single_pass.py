"""Diffuse and glossy reflection from a cube that is captured again for every frame."""

import numpy as np
import pytest

from mirrorbake import InvalidArgument, _core
from mirrorbake.envmap import EnvMap
from mirrorbake.literals import NegativeLight
from mirrorbake.prefilter import Harmonics, Prefilter, irradiance, lambert, phong
from mirrorbake.prefilter.single_pass import CapturedLight
from mirrorbake.projection import texel_directions

NEGATIVE: tuple[NegativeLight, ...] = ("clamp", "keep")


def sky(size: int = 64) -> EnvMap:
    d = np.stack([texel_directions("cube", size, size, face) for face in range(6)])
    light = 0.5 + 0.4 * d[..., 1:2] + 3 * (d @ np.array([0.36, 0.8, 0.48], np.float32) > 0.9)[..., None]
    return EnvMap.from_array((light * [1, 0.8, 0.6]).astype(np.float32), "cube")


def ball(count: int = 200) -> np.ndarray:
    normals = np.random.default_rng(1).normal(size=(count, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    unit: np.ndarray = normals / np.linalg.norm(normals, axis=1)[:, None]
    return unit


def test_eight_texels_are_enough_for_diffuse_light() -> None:
    source, normals = sky(), ball()
    exact = Prefilter(source).sample(lambert(), normals, scale="sum")
    errors = [
        np.abs(CapturedLight.make(source, diffuse_size=size).irradiance.sample(normals) - exact).max()
        for size in (8, 64)
    ]
    # Most of it is that of nine harmonics ([AEM] §5.1.1: 8² are sufficient).
    assert errors[0] < 0.05 * exact.max()
    assert errors[0] < 1.2 * errors[1]


def test_light_is_shared_out_by_fresnel() -> None:
    light, normals, view = CapturedLight.make(sky()), ball(), np.array([0.0, 0.0, 1.0])
    both = light.shade(normals, view, bias=2.0, diffuse=[0.5, 0.2, 0.1], reflectance=0.1)
    share = 0.1 + 0.9 * (1 - normals[:, 2:]) ** 5
    diffuse = light.irradiance.sample(normals) * [0.5, 0.2, 0.1] / np.pi
    mirrored = 2 * normals[:, 2:] * normals - view
    glossy = light.cube.sample(mirrored.astype(np.float32), filter="trilinear", level=2.0)
    np.testing.assert_allclose(both, (1 - share) * diffuse + share * glossy, rtol=1e-5)
    np.testing.assert_allclose(
        light.shade(normals, view, reflectance=1.0), light.shade(normals, view, reflectance=1.0, diffuse=0)
    )


def test_a_bias_looks_like_a_lobe() -> None:
    source, normals = sky(32), ball()
    view = np.array([0.0, 0.0, 1.0])
    seen = CapturedLight.make(source).shade(normals, view, bias=2.25, reflectance=1.0)
    mirrored = 2 * normals[:, 2:] * normals - view
    exact = Prefilter(source).sample(phong(200), mirrored)
    assert np.linalg.norm(seen - exact) / np.linalg.norm(exact) < 0.2


def test_a_moving_light_moves_on_what_is_captured() -> None:
    def captured(x: float) -> CapturedLight:
        scene = _core.Scene()
        lamp = scene.add_material(_core.Material(emission=[20.0, 20.0, 20.0]))
        scene.add_object("lamp", _core.make_sphere([x, 2.0, 0.0], 0.3, 12), lamp)
        grey = scene.add_material(_core.Material(albedo=[0.5, 0.5, 0.5]))
        scene.add_object("ball", _core.make_sphere([0.0, 0.0, 0.0], 0.5, 12), grey)
        return CapturedLight.capture(_core.Tracer(scene), [0, 0, 0], 8, hidden=[1], samples=16)

    left, right = captured(-2.0), captured(2.0)
    sides = np.array([[-1.0, 0, 0], [1.0, 0, 0]])
    assert left.irradiance.sample(sides)[0, 0] > 2 * left.irradiance.sample(sides)[1, 0]
    np.testing.assert_allclose(left.irradiance.sample(sides)[0], right.irradiance.sample(sides)[1], rtol=0.1)


def test_what_is_no_cube_is_refused() -> None:
    with pytest.raises(InvalidArgument, match="latlong"):
        CapturedLight.make(sky(8).resample("latlong", 8))
    with pytest.raises(InvalidArgument, match="diffuse_size is 0"):
        CapturedLight.make(sky(8), diffuse_size=0)


def test_harmonics_are_sampled_as_they_are_evaluated() -> None:
    light = Harmonics.project(sky(16), 4)
    d = np.stack([texel_directions("cube", 4, 4, face) for face in range(6)])
    for negative in NEGATIVE:
        expected = light.evaluate(4, negative=negative).level()
        found = light.sample(d, negative=negative)
        np.testing.assert_allclose(found, expected, atol=1e-5)
    assert irradiance(sky(16), 4).level().shape == light.sample(d).shape
