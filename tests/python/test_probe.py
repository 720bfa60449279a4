"""The rendering matrix of renderers of which only pictures are to be had."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from benchmarks._page import layers_of, reads_of_the_page

import mirrorbake as mb
import opengl
from mirrorbake._core import Proxy
from mirrorbake.envmap import EnvMap

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

Torus = tuple[mb.SurfaceSamples, "dict[str, NDArray[np.float32]]"]

IMAGE = 96
MAP = 128

# The reads of the page's own shader, for directions and differentials out of textures.
PAGE = """#version 330
uniform sampler2D uD;
uniform sampler2D uDdx;
uniform sampler2D uDdy;
uniform float uSize;
out vec4 oColour;
{reads}
void main() {{
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 d = texelFetch(uD, at, 0).xyz;
  if (dot(d, d) == 0.0) {{
    oColour = vec4(0.0);
    return;
  }}
  Taps taps = tapsOf(d, texelFetch(uDdx, at, 0).xyz, texelFetch(uDdy, at, 0).xyz, uSize);
  vec3 sum = vec3(0.0);
  for (int tap = 0; tap < tapCount(taps); ++tap) {{
    float weight;
    vec3 place = tapDirection(taps, d, tap, weight);
    sum += weight * readRadiance(place, taps.level, uSize, 0.0);
  }}
  oColour = vec4(sum, 1.0);
}}
"""

# Two paraboloids ([EMT] section 2.3) as textures, filtered as the driver likes to, in a tinted mirror that
# glows.
DRIVER = """#version 330
uniform sampler2D uD;
uniform sampler2D uDdx;
uniform sampler2D uDdy;
uniform sampler2D uFront;
uniform sampler2D uBack;
out vec4 oColour;
vec2 place(vec3 d, float side) {
  vec2 st = d.xy / (1.0 + side * d.z);
  return 0.5 + 0.5 * vec2(st.x, -st.y);
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 d = texelFetch(uD, at, 0).xyz;
  if (dot(d, d) == 0.0) {
    oColour = vec4(0.25, 0.25, 0.25, 1.0);
    return;
  }
  vec3 dx = texelFetch(uDdx, at, 0).xyz;
  vec3 dy = texelFetch(uDdy, at, 0).xyz;
  float side = d.z < 0.0 ? -1.0 : 1.0;
  vec2 st = place(d, side);
  vec2 right = (place(d + 0.01 * dx, side) - st) * 100.0;
  vec2 down = (place(d + 0.01 * dy, side) - st) * 100.0;
  vec3 seen = d.z < 0.0 ? textureGrad(uBack, st, right, down).rgb : textureGrad(uFront, st, right, down).rgb;
  oColour = vec4(vec3(1.0, 0.8, 0.5) * seen + vec3(0.0, 0.0, 0.125), 1.0);
}
"""


@pytest.fixture(scope="module")
def torus() -> Torus:
    """A mirror torus, one lookup in the middle of every pixel, and its rays as images."""
    scene = mb.Scene()
    mirror = scene.add_material(
        mb.Material(albedo=(0, 0, 0), specular=True, fresnel=mb.Fresnel("constant", r0=(1, 1, 1)))
    )
    reflector = scene.add_object("torus", mb.make_torus((0, 0, 0), 0.1, 0.045), mirror)
    tracer = mb.Tracer(scene, mb.TracerOptions(indirect="none"))
    camera = mb.Camera((0.0, 0.35, 0.6), (0.0, 0.0, 0.0), vertical_fov_degrees=25, width=IMAGE, height=IMAGE)
    samples = tracer.trace_visibility(camera, reflector, places=[(0.5, 0.5)])
    images = {}
    fields = (("uD", samples.reflection), ("uDdx", samples.dreflection_dx), ("uDdy", samples.dreflection_dy))
    for name, values in fields:
        image = np.zeros((IMAGE * IMAGE, 3), np.float32)
        image[samples.pixel] = values
        images[name] = image.reshape(IMAGE, IMAGE, 3)
    return samples, images


def levels_of(topology: mb.TexelTopology, texels: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    return [
        texels[topology.level_offset(k) : topology.level_offset(k + 1)].reshape(
            topology.faces, topology.height(k), topology.width(k), 3
        )
        for k in range(topology.levels)
    ]


@pytest.fixture(scope="module")
def page(torus: Torus) -> Callable[[NDArray[np.float32]], NDArray[np.float32]]:
    """The page's shader as a renderer of cube maps."""
    context = opengl.context()
    screen = opengl.Screen(context, PAGE.format(reads=reads_of_the_page()), torus[1])
    topology = mb.TexelTopology.cube(MAP)

    def render(texels: NDArray[np.float32]) -> NDArray[np.float32]:
        layers = layers_of([EnvMap.from_array(level, "cube") for level in levels_of(topology, texels)])
        array = context.texture_array((layers.shape[2], layers.shape[1], 6), 3, layers.tobytes(), dtype="f4")
        array.filter = (context.LINEAR, context.LINEAR)
        array.repeat_x = array.repeat_y = False
        layer = (1 / layers.shape[2], 1 / layers.shape[1])
        image = screen.draw({"uRadiance": array}, {"uSize": float(MAP), "uMaxTaps": 4, "uLayer": layer})
        array.release()
        return image

    return render


def dense_rows(matrix: mb.RenderingMatrix) -> dict[int, dict[int, float]]:
    rows = {}
    for row, pixel in enumerate(matrix.row_pixels):
        entries = slice(int(matrix.row_offsets[row]), int(matrix.row_offsets[row + 1]))
        rows[int(pixel)] = dict(
            zip(matrix.texels[entries].tolist(), matrix.weights[entries].tolist(), strict=True)
        )
    return rows


def test_the_page_s_shader_reads_with_the_analytic_matrix(
    torus: Torus, page: Callable[[NDArray[np.float32]], NDArray[np.float32]]
) -> None:
    samples, _ = torus
    topology = mb.TexelTopology.cube(MAP)
    one = mb.RunTimeModel(name="middle", places=[(0.5, 0.5)], footprint_scale=1.0)
    analytic = dense_rows(mb.build_rendering_matrix(samples, 0, Proxy.infinite(), topology, one))
    probed = mb.probe_rendering_matrix(topology, page)
    assert probed.renderings <= 64
    found = dense_rows(probed.matrix)
    assert probed.unresolved <= 0.02 * len(analytic)
    assert len(found) + probed.unresolved == len(analytic)
    # Bilinear weights have at least 8 bits on a card; on Mesa all is within 3e-5.
    worst = 0.0
    for pixel, row in found.items():
        texels = row.keys() | analytic[pixel].keys()
        worst = max(worst, *(abs(row.get(t, 0.0) - analytic[pixel].get(t, 0.0)) for t in texels))
    assert worst <= 1 / 256


def driver(torus: Torus, anisotropy: float) -> Callable[[NDArray[np.float32]], NDArray[np.float32]]:
    """A renderer that leaves levels and taps to the driver."""
    context = opengl.context()
    screen = opengl.Screen(context, DRIVER, torus[1])
    topology = mb.TexelTopology.dual_paraboloid(MAP)

    def render(texels: NDArray[np.float32]) -> NDArray[np.float32]:
        sheets = []
        for face in range(2):
            sheet = context.texture((MAP, MAP), 3, dtype="f4")
            sheet.build_mipmaps()
            for k, level in enumerate(levels_of(topology, texels)):
                sheet.write(level[face].tobytes(), level=k)
            sheet.filter = (context.LINEAR_MIPMAP_LINEAR, context.LINEAR)
            sheet.repeat_x = sheet.repeat_y = False
            sheet.anisotropy = anisotropy
            sheets.append(sheet)
        image = screen.draw({"uFront": sheets[0], "uBack": sheets[1]}, {})
        for sheet in sheets:
            sheet.release()
        return image

    return render


# Anisotropic reads of 64 texels at the silhouette take more colours than 64 pictures have.
@pytest.mark.parametrize(("anisotropy", "left_out"), [(1.0, 0.0), (4.0, 0.06)])
def test_a_driver_s_own_filter_is_reproduced_on_any_map(
    torus: Torus, anisotropy: float, left_out: float
) -> None:
    topology = mb.TexelTopology.dual_paraboloid(MAP)
    render = driver(torus, anisotropy)
    probed = mb.probe_rendering_matrix(topology, render)
    assert probed.renderings <= 64
    assert probed.unresolved <= left_out * len(torus[0])
    map_ = np.random.default_rng(3).random((topology.texels, 3), dtype=np.float32)
    glow = render(np.zeros_like(map_)).reshape(-1, 3)[probed.matrix.row_pixels]
    drawn = render(map_).reshape(-1, 3)[probed.matrix.row_pixels]
    # Sums of up to 64 float32 products; the driver's own weights are kept exactly.
    np.testing.assert_allclose(glow + probed.scales * probed.matrix.multiply(map_), drawn, atol=1e-5)
    np.testing.assert_allclose(
        probed.scales / probed.scales[:, :1], [[1.0, 0.8, 0.5]] * len(drawn), rtol=1e-5
    )


def test_maps_inferred_for_a_driver_look_better_in_it(torus: Torus) -> None:
    """One target, inferred by our reads and by the driver's, drawn by the driver."""
    samples, images = torus
    render = driver(torus, 4.0)
    topology = mb.TexelTopology.dual_paraboloid(MAP)
    one = mb.RunTimeModel(name="middle", places=[(0.5, 0.5)], footprint_scale=1.0)
    d = np.float64(images["uD"].reshape(-1, 3))
    waves = 0.5 + 0.4 * np.sin(d @ np.array([[61.0, 3.0, 25.0], [12.0, 59.0, 34.0], [36.0, 21.0, 58.0]]))

    def drawn(matrix: mb.RenderingMatrix, pixels: NDArray[np.uint32]) -> float:
        target = waves[pixels].astype(np.float32)
        solver = mb.MapSolver([(matrix, [(0, 1.0)])], [topology], options=mb.SolveOptions(tolerance=1e-4))
        texels, _ = solver.solve([target], [np.ones_like(target)])
        seen = (render(texels).reshape(-1, 3)[pixels] - [0.0, 0.0, 0.125]) / [1.0, 0.8, 0.5]
        return float(-10.0 * np.log10(np.mean((seen - target) ** 2)))

    probed = mb.probe_rendering_matrix(topology, render).matrix
    ours = mb.build_rendering_matrix(samples, 0, Proxy.infinite(), topology, one)
    by_ours, by_theirs = drawn(ours, ours.row_pixels), drawn(probed, probed.row_pixels)
    assert by_theirs > by_ours + 3.0


def test_a_renderer_that_raises_is_heard() -> None:
    def broken(texels: NDArray[np.float32]) -> NDArray[np.float32]:
        raise RuntimeError("the card is on fire")

    with pytest.raises(RuntimeError, match="on fire"):
        mb.probe_rendering_matrix(mb.TexelTopology.cube(4), broken)


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"most_renderings": 15}, "most_renderings"),
        ({"step": 0.2}, "step"),
        ({"tolerance": 0.0}, "tolerance"),
    ],
)
def test_options_out_of_range_are_named(options: dict[str, Any], name: str) -> None:
    with pytest.raises(ValueError, match=name):
        mb.probe_rendering_matrix(
            mb.TexelTopology.cube(4), lambda texels: np.zeros((2, 2, 3), np.float32), **options
        )
