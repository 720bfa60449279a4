"""Arrays of the wrong kind: an error that says which, not a number made of it."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mirrorbake import _core, fresnel, projection
from mirrorbake.envmap import EnvMap

SKY = EnvMap.from_array(np.ones((4, 8, 3), np.float32), "latlong")
ROOM = _core.Proxy.box((0, 0, 0), (1, 1, 1))

# Of each function: its argument's name, the shape that it takes, and a call.
FUNCTIONS: dict[str, tuple[str, tuple[int, ...], Callable[[Any], Any]]] = {
    "EnvMap.from_array": ("array", (4, 8, 3), lambda a: EnvMap.from_array(a, "latlong")),
    "EnvMap.sample": ("directions", (5, 3), SKY.sample),
    "EnvMap.resample": (
        "source_from_target",
        (3, 3),
        lambda a: SKY.resample("cube", 2, source_from_target=a),
    ),
    "points_from_directions": ("directions", (5, 3), lambda a: projection.points_from_directions("cube", a)),
    "directions_from_points": ("points", (5, 2), lambda a: projection.directions_from_points("cube", 0, a)),
    "dual_paraboloid_texture_matrix": (
        "frame_from_map",
        (3, 3),
        lambda a: projection.dual_paraboloid_texture_matrix(a, 0),
    ),
    "schlick": ("c", (5,), lambda a: fresnel.schlick(a, 0.5)),
    "schlick r0": ("r0", (5,), lambda a: fresnel.schlick(np.float32(0.5), a)),
    "dielectric": ("c", (5,), lambda a: fresnel.dielectric(a, 1.5)),
    "dielectric ior": ("ior", (), lambda a: fresnel.dielectric(0.5, a)),
    "dielectric_transmittance": ("c", (5,), lambda a: fresnel.dielectric_transmittance(a, 1.5)),
    "conductor": ("c", (5,), lambda a: fresnel.conductor(a, 0.2, 3.9)),
    "conductor k": ("k", (5,), lambda a: fresnel.conductor(0.5, 0.2, a)),
    "metal_reflectance": ("c", (5,), lambda a: fresnel.metal_reflectance("gold", a)),
    "save_image": ("save_image", (2, 2, 3), lambda a: _core.save_image("", a, ["R", "G", "B"])),
    "set_environment": ("set_environment", (4, 8, 3), lambda a: _core.Scene().set_environment(a, 1.0, 0.0)),
    "fit_ellipsoid": ("fit_ellipsoid", (5, 3), lambda a: _core.fit_ellipsoid(a, (0, 0, 0))),
    "Proxy.lookup": ("lookup", (5, 3), lambda a: ROOM.lookup(a, a)),
}


@pytest.mark.parametrize("dtype", ["complex64", "complex128", "object", "str", "bytes", "datetime64[s]"])
@pytest.mark.parametrize("function", FUNCTIONS)
def test_anything_but_real_numbers_is_a_type_error(function: str, dtype: str) -> None:
    name, shape, call = FUNCTIONS[function]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(TypeError, match=name):
            call(np.zeros(shape).astype(np.int64).astype(dtype))


@pytest.mark.parametrize("dtype", ["float16", "float64", "longdouble", "int8", "uint64", "bool"])
def test_real_numbers_of_any_dtype_are_taken(dtype: str) -> None:
    ones = np.ones((4, 8, 3), dtype)
    np.testing.assert_array_equal(EnvMap.from_array(ones, "latlong").level(), np.float32(1))
    np.testing.assert_allclose(fresnel.schlick(ones, 0.5), 0.5)
    assert SKY.sample(ones).shape == (4, 8, 3)


def test_faces_are_whole_numbers() -> None:
    points = np.zeros((2, 2), np.float32)
    with pytest.raises(TypeError, match="faces has the dtype float64, expected integers"):
        projection.directions_from_points("cube", [0.5, 1.0], points)


def test_no_elements_give_none() -> None:
    none = np.empty((0, 3), np.float32)
    assert SKY.sample(none).shape == (0, 3)
    faces, points = projection.points_from_directions("cube", none)
    assert (faces.shape, points.shape) == ((0,), (0, 2))
    assert projection.directions_from_points("cube", faces, points).shape == (0, 3)
    for curve in (fresnel.Schlick(0.04), fresnel.Dielectric(1.5), fresnel.Conductor(0.2, 3.9)):
        assert curve([]).shape == (0,)
    assert fresnel.dielectric_transmittance([], 1.5).shape == (0,)
    assert fresnel.metal_reflectance("gold", []).shape == (0, 3)
    assert ROOM.lookup(none, none).shape == (0, 3)


@pytest.mark.parametrize("shape", [(0, 0, 3), (0, 8, 3), (4, 0, 3), (4, 8, 0), (0,)])
def test_a_map_without_texels_is_an_error(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="expected"):
        EnvMap.from_array(np.empty(shape, np.float32), "latlong")
