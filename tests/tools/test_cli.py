"""The command line as a user meets it: a process, its exit status, its two output streams and its files."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from typer.testing import CliRunner

from mirrorbake import _core
from mirrorbake.commands.main import app
from mirrorbake.evaluate.contenders import CONTENDERS
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.render import picture_of
from mirrorbake.pem.store import GROUP_NAME, PemStore
from mirrorbake.scene.load import load_config
from mirrorbake.scene.plan import DECIDED_KEYS
from mirrorbake.tone import tone_map

EXIT_USAGE, EXIT_INPUT = 2, 3

SCENE = """
[reflector]
object = "teapot"
subdivisions = 4
parts = "split"
[views]
count = 3
degrees = 4
size = [40, 30]
[maps]
size = 16
[trace]
samples = 2
indirect = "none"
"""


@dataclass(frozen=True)
class Outcome:
    returncode: int
    stdout: str
    stderr: str


def run(*arguments: str | Path, cwd: Path | None = None) -> Outcome:
    """Run a command in this process, which saves starting Python and counts towards the coverage."""
    with contextlib.chdir(cwd or Path.cwd()):
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return Outcome(result.exit_code, result.stdout, result.stderr)


def run_process(*arguments: str | Path) -> Outcome:
    command = [sys.executable, "-m", "mirrorbake", *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    return Outcome(result.returncode, result.stdout, result.stderr)


def assert_one_error(result: Outcome, *words: str, status: int = EXIT_INPUT) -> None:
    assert result.returncode == status, result.stderr
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    errors = [line for line in result.stderr.splitlines() if line.startswith("mirrorbake: error: ")]
    assert len(errors) == 1, result.stderr
    for word in words:
        assert word in errors[0]


def write_scene(folder: Path, text: str = SCENE) -> Path:
    scene = folder / "scene.toml"
    scene.write_text(text)
    return scene


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished PEM; tests only read it."""
    folder = tmp_path_factory.mktemp("baked")
    result = run("bake", write_scene(folder), "--out", folder / "pem")
    assert result.returncode == 0, result.stderr
    assert result.stdout == ""
    return folder / "pem"


def read_maps(directory: Path) -> dict[str, np.ndarray]:
    """Every array of a PEM but the record, whose seconds differ between any two runs."""
    group = zarr.open_group(directory / GROUP_NAME, mode="r")
    arrays = {}

    def collect(group: zarr.Group, path: str) -> None:
        for name, member in group.members():
            if isinstance(member, zarr.Array):
                arrays[f"{path}/{name}"] = np.asarray(member[...])
            else:
                collect(member, f"{path}/{name}")

    collect(group, "")
    del arrays["/record"]
    return arrays


def assert_same_bits(first: Path, second: Path) -> None:
    a, b = read_maps(first), read_maps(second)
    assert a.keys() == b.keys()
    assert "/maps" in a
    for name, array in a.items():
        assert array.tobytes() == b[name].tobytes(), name


def test_version_is_the_librarys() -> None:
    result = run_process("--version")
    assert (result.returncode, result.stdout) == (0, f"mirrorbake {_core.version()}\n")


def test_a_process_ends_with_the_status_and_the_streams_of_the_manual(tmp_path: Path) -> None:
    assert run_process("fly").returncode == EXIT_USAGE
    scene = write_scene(tmp_path)
    wrong = run_process("bake", scene, "--out", tmp_path / "pem", "--em-size", "3")
    assert_one_error(wrong, "maps.size = 3", status=EXIT_USAGE)
    result = run_process("bake", scene, "--out", tmp_path / "pem", "--views", "1")
    assert (result.returncode, result.stdout) == (0, ""), result.stderr
    result = run_process("evaluate", tmp_path / "pem", "--json")
    assert result.returncode == 0
    assert json.loads(result.stdout)["views"][0]["place"] == "on"


def test_the_c_locale_can_print_everything() -> None:
    plain = os.environ | {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    command = [sys.executable, "-m", "mirrorbake", "study", "fresnel", "--samples", "50"]
    result = subprocess.run(command, capture_output=True, env=plain, check=False)
    assert result.returncode == 0, result.stderr
    assert not result.stdout.isascii()
    assert "\ufffd" not in result.stdout.decode()


@pytest.mark.parametrize("command", ["bake", "analyze", "evaluate", "sheet", "render", "demo"])
def test_every_command_explains_itself(command: str) -> None:
    result = run(command, "--help")
    assert result.returncode == 0
    assert "--threads" in result.stdout
    assert result.stderr == ""


@pytest.mark.parametrize(
    "arguments",
    [
        ["fly"],
        ["bake"],
        ["bake", "scene.toml"],
        ["bake", "scene.toml", "--out", "x", "--size", "512"],
        ["bake", "scene.toml", "--out", "x", "--size", "-1x5"],
        ["bake", "scene.toml", "--out", "x", "--views", "many"],
        ["bake", "scene.toml", "--out", "x", "--set", "maps.size"],
        ["bake", "scene.toml", "--out", "x", "--threads", "-1"],
        ["bake", "scene.toml", "--out", "x", "--colour"],
        ["evaluate"],
        ["render", "dir", "--out", "a.png"],
        ["render", "dir", "--view", "half", "--out", "a.png"],
        ["render", "dir", "--view", "0", "--frames", "2", "--out", "a.png"],
        ["render", "dir", "--frames", "2", "--away", "1,0", "--out", "a{}.png"],
        ["sheet"],
        ["export", "dir"],
        ["export", "dir", "--glb", "a.gltf"],
        ["export", "dir", "--glb", "a.glb", "--convention", "unity"],
        ["export", "dir", "--maps", "a", "--fps", "3"],
        ["export", "dir", "--video", "a.mp4", "--all"],
        ["export", "dir", "--web", "a.html"],
        ["export", "dir", "--web", "a", "--single-file"],
        ["export", "dir", "--web", "a", "--exact", "--quality", "90"],
    ],
)
def test_wrong_usage_is_exit_2(tmp_path: Path, arguments: list[str]) -> None:
    result = run(*arguments, cwd=tmp_path)
    assert result.returncode == EXIT_USAGE
    assert result.stdout == ""
    assert result.stderr.startswith("mirrorbake: error: ")
    assert result.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "found"), [("mirrorbake sh", "sheet"), ("mirrorbake render --tone", "--tone-map")]
)
def test_the_shell_completes_commands_and_options(words: str, found: str) -> None:
    program = Path(sys.executable).with_name("mirrorbake")
    shell = {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    environment = os.environ | shell | {"_MIRRORBAKE_COMPLETE": "complete_bash"}
    result = subprocess.run([program], capture_output=True, text=True, env=environment, check=False)
    assert result.stdout.split() == [found], result.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--size", "0x30"], ["views.size.0 = 0", "greater than or equal to 1"]),
        (["--size", "40x16385"], ["views.size.1 = 16385", "less than or equal to 16384"]),
        (["--views", "0"], ["views.count = 0"]),
        (["--spp", "0"], ["trace.samples = 0"]),
        (["--spp", "65537"], ["trace.samples = 65537"]),
        (["--em-size", "100"], ["maps.size = 100", "power of two"]),
        (["--em-size", "8192"], ["maps.size = 8192"]),
        (["--seed", "-1"], ["trace.seed = -1"]),
        (["--set", "maps.sise=16"], ["maps.sise", "is not a key"]),
    ],
)
def test_a_value_out_of_range_is_one_clear_error(
    tmp_path: Path, options: list[str], words: list[str]
) -> None:
    result = run("bake", write_scene(tmp_path), "--out", tmp_path / "pem", *options, cwd=tmp_path)
    assert_one_error(result, *words, status=EXIT_USAGE)
    assert "scene.toml" not in result.stderr
    assert not (tmp_path / "pem").exists()


@pytest.mark.parametrize(
    ("key", "file"),
    [
        ("reflector.mesh", "nowhere.obj"),
        ("surroundings.panorama", "nowhere.exr"),
        ("material.texture", "nowhere.png"),
    ],
)
def test_a_missing_file_is_one_clear_error(tmp_path: Path, key: str, file: str) -> None:
    options = ["--set", f"{key}={file}"]
    result = run("bake", write_scene(tmp_path), "--out", tmp_path / "pem", *options, cwd=tmp_path)
    assert_one_error(result, file, "No such file")
    assert not (tmp_path / "pem").exists()


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", []),
        (b"\x00\xff\x17 not a mesh", []),
        (TRIANGLE.encode() + b"f 1 2 9\n", []),
        (TRIANGLE.replace("1 0 0", "nan 0 0").encode() + b"f 1 2 3\n", []),
        (TRIANGLE.replace("1 0 0", "inf 0 0").encode() + b"f 1 2 3\n", []),
        (b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", []),
    ],
    ids=["empty", "binary", "index", "nan", "inf", "zero-area"],
)
def test_an_unusable_mesh_is_one_clear_error(tmp_path: Path, content: bytes, words: list[str]) -> None:
    mesh = tmp_path / "broken.obj"
    mesh.write_bytes(content)
    scene = write_scene(tmp_path)
    result = run("bake", scene, "--out", tmp_path / "pem", "--set", f"reflector.mesh={mesh}")
    assert_one_error(result, "broken.obj", *words)
    assert not (tmp_path / "pem").exists()


EXR_MAGIC = b"\x76\x2f\x31\x01\x02\x00\x00\x00"


@pytest.mark.parametrize("content", [b"", b"not an image", EXR_MAGIC + b"\xff" * 64])
def test_a_panorama_that_is_corrupt_is_one_clear_error(tmp_path: Path, content: bytes) -> None:
    panorama = tmp_path / "broken.exr"
    panorama.write_bytes(content)
    scene = write_scene(tmp_path)
    result = run("bake", scene, "--out", tmp_path / "pem", "--set", f"surroundings.panorama={panorama}")
    assert_one_error(result, "broken.exr")
    assert not (tmp_path / "pem").exists()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_panorama_with_impossible_radiance_is_one_clear_error(tmp_path: Path, value: float) -> None:
    pixels = np.ones((4, 8, 3), np.float32)
    pixels[1, 2, 0] = value
    panorama = tmp_path / "sky.exr"
    _core.save_image(str(panorama), pixels, ["R", "G", "B"], "float32")
    scene = write_scene(tmp_path)
    result = run("bake", scene, "--out", tmp_path / "pem", "--set", f"surroundings.panorama={panorama}")
    assert_one_error(result, "sky.exr", "1 values are NaN or infinite")
    assert not (tmp_path / "pem").exists()


def test_a_panorama_is_repaired_where_the_scene_says_so(tmp_path: Path) -> None:
    pixels = np.ones((4, 8, 3), np.float32)
    pixels[1, 2, 0] = np.nan
    panorama = tmp_path / "sky.exr"
    _core.save_image(str(panorama), pixels, ["R", "G", "B"], "float32")
    sky = ["--set", f"surroundings.panorama={panorama}", "--set", "surroundings.repair=true"]
    result = run("bake", write_scene(tmp_path), "--out", tmp_path / "pem", *sky, "--views", "1")
    assert result.returncode == 0, result.stderr
    capture = PemStore.open(tmp_path / "pem").read_capture()
    assert np.isfinite(capture).all()


def test_negative_radiance_is_taken_as_0_with_a_warning(tmp_path: Path) -> None:
    pixels = np.ones((4, 8, 3), np.float32)
    pixels[1, 2:4, 0] = -0.5
    panorama = tmp_path / "sky.exr"
    _core.save_image(str(panorama), pixels, ["R", "G", "B"])
    options = ["--set", f"surroundings.panorama={panorama}", "--views", "1"]
    result = run("bake", write_scene(tmp_path), "--out", tmp_path / "pem", *options)
    assert result.returncode == 0, result.stderr
    assert f"warning: {panorama}: 2 negative values were taken as 0" in result.stderr
    capture = PemStore.open(tmp_path / "pem").read_capture()
    assert capture.min() >= 0.0
    assert capture.min() < 0.5 < capture.max()


def test_a_view_inside_the_object_is_one_clear_error(tmp_path: Path) -> None:
    options = ["views.radius=0.001", "views.height=0", "views.centre=[0,0.06,0]"]
    sets = [argument for option in options for argument in ("--set", option)]
    result = run("bake", write_scene(tmp_path), "--out", tmp_path / "pem", *sets)
    assert_one_error(result, "the eye at t = 0", "lies inside the reflector")
    assert not (tmp_path / "pem").exists()


def test_an_output_that_cannot_be_written_is_one_clear_error(tmp_path: Path) -> None:
    scene = write_scene(tmp_path)
    (tmp_path / "file").write_text("mine")
    assert_one_error(run("bake", scene, "--out", tmp_path / "file"), "is a file")
    assert_one_error(run("bake", scene, "--out", tmp_path / "file" / "pem"), "cannot write")
    assert (tmp_path / "file").read_text() == "mine"
    assert_one_error(run("bake", scene, "--out", "/proc/pem"), "/proc/pem", "cannot write")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_an_output_without_permission_is_one_clear_error(tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    assert_one_error(run("bake", write_scene(tmp_path), "--out", locked / "pem"), "Permission denied")


def test_a_folder_of_other_things_is_left_alone(tmp_path: Path) -> None:
    scene = write_scene(tmp_path)
    result = run("bake", scene, "--out", tmp_path)
    assert_one_error(result, "is not empty and holds no PEM")
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


def test_a_pem_of_another_scene_is_left_alone(baked: Path, tmp_path: Path) -> None:
    before = read_maps(baked)
    result = run("bake", write_scene(tmp_path), "--out", baked, "--em-size", "32")
    assert_one_error(result, "holds a PEM of another scene", "maps.size = 16 instead of 32")
    after = read_maps(baked)
    assert all(np.array_equal(before[name], after[name]) for name in before)


def test_a_finished_bake_is_not_done_again(baked: Path, tmp_path: Path) -> None:
    mark = baked / GROUP_NAME / "record" / "c" / "2" / "0"
    before = mark.stat().st_mtime_ns
    result = run("bake", write_scene(tmp_path), "--out", baked)
    assert result.returncode == 0
    assert "3 samples, 3 of them from an earlier run" in result.stderr
    assert mark.stat().st_mtime_ns == before


def test_a_bake_that_is_killed_is_resumed_to_the_same_bits(baked: Path, tmp_path: Path) -> None:
    scene, out = write_scene(tmp_path), tmp_path / "pem"
    command = [sys.executable, "-m", "mirrorbake", "bake", str(scene), "--out", str(out)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    mark = out / GROUP_NAME / "record" / "c" / "0" / "0"
    deadline = time.monotonic() + 120
    while not mark.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.001)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    done = int(PemStore.open(out).completed().sum())
    assert 1 <= done < 3
    for command_name in ("evaluate", "render"):
        extra = [] if command_name == "evaluate" else ["--view", "0", "--out", str(tmp_path / "a.png")]
        assert_one_error(run(command_name, out, *extra), f"only {done} of 3 samples are baked")
    assert not (tmp_path / "a.png").exists()
    result = run("bake", scene, "--out", out)
    assert result.returncode == 0, result.stderr
    assert f"3 samples, {done} of them from an earlier run" in result.stderr
    assert_same_bits(out, baked)
    assert not list(out.rglob("*.partial"))


def test_a_resumed_bake_keeps_to_what_was_decided_and_says_it(baked: Path, tmp_path: Path) -> None:
    plan = PemStore.open(baked).header.plan
    result = run("bake", write_scene(tmp_path), "--out", baked)
    for line in plan.lines():
        assert line in result.stderr
    assert any(decision.automatic for decision in plan.decisions)
    # A value of one's own is another scene, even if it is the one that was decided.
    depth = f"trace.depth={plan.depth}"
    other = run("bake", write_scene(tmp_path), "--out", baked, "--set", depth)
    assert_one_error(other, f"trace.depth = 'auto' instead of {plan.depth}")


def test_analyze_prints_exactly_what_a_bake_with_the_same_options_does(tmp_path: Path) -> None:
    scene = write_scene(tmp_path)
    options = ["--views", "1", "--set", "maps.size=auto", "--set", "layers.local=false"]
    analyzed = run("analyze", scene, *options)
    assert (analyzed.returncode, analyzed.stderr) == (0, "")
    lines = analyzed.stdout.splitlines()
    decided = [line for line in lines if not line.startswith("# ")]
    # Sizes are decided map by map, one line after another.
    assert list(dict.fromkeys(line.split(" = ")[0] for line in decided)) == list(DECIDED_KEYS)
    assert any("a PEM" in line for line in lines if line.startswith("# "))
    assert "layers.local = false  # set in the scene" in lines
    baked = run("bake", scene, "--out", tmp_path / "pem", *options)
    assert baked.returncode == 0, baked.stderr
    for line in lines:
        assert line in baked.stderr.splitlines()
    printed = run("analyze", scene, *options, "--json")
    assert json.loads(printed.stdout) == PemStore.open(tmp_path / "pem").header.plan.to_dict()


def test_one_and_two_threads_bake_the_same_bits(tmp_path: Path) -> None:
    scene = write_scene(tmp_path)
    for threads in (1, 2):
        result = run("bake", scene, "--out", tmp_path / str(threads), "--threads", str(threads))
        assert result.returncode == 0, result.stderr
    assert_same_bits(tmp_path / "1", tmp_path / "2")


def test_another_seed_bakes_other_bits(baked: Path, tmp_path: Path) -> None:
    result = run("bake", write_scene(tmp_path), "--out", tmp_path / "pem", "--seed", "1")
    assert result.returncode == 0, result.stderr
    ours, theirs = read_maps(tmp_path / "pem"), read_maps(baked)
    assert not np.array_equal(ours["/maps"], theirs["/maps"])


def test_options_override_the_scene_file(tmp_path: Path) -> None:
    options = ["--views", "2", "--size", "24x16", "--spp", "1", "--em-size", "8"]
    result = run("bake", write_scene(tmp_path), "--out", tmp_path / "pem", *options)
    assert result.returncode == 0, result.stderr
    header = PemStore.open(tmp_path / "pem").header
    assert (header.space.samples(), header.image_size, header.map_size) == ([(0.0,), (1.0,)], (24, 16), 8)
    assert header.source.config["trace"]["samples"] == 1


def test_evaluate_writes_the_figures_it_prints(baked: Path) -> None:
    result = run("evaluate", baked, "--json")
    assert result.returncode == 0, result.stderr
    printed: dict[str, Any] = json.loads(result.stdout)
    written = json.loads((baked / "metrics.json").read_text())
    assert printed == written
    views = written["views"]
    assert [view["place"] for view in views[:3]] == ["on", "between", "off_1"]
    for view in views:
        assert view["psnr"].keys() == set(CONTENDERS)
        assert all(5 < row["reference"] < 80 for row in view["psnr"].values())
        assert all(row["reference"] + 5.9 < view["ceiling"] for row in view["psnr"].values())
    table = run("evaluate", baked)
    assert table.returncode == 0
    assert "PEM" in table.stdout
    assert f"{views[0]['psnr']['pem']['reference']:.2f}" in table.stdout


def test_the_demonstration_leaves_figures_and_a_contact_sheet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = write_scene(tmp_path)
    monkeypatch.setattr("mirrorbake.evaluate.demo.demo_config", lambda: load_config(scene))
    result = run("demo", "--out", tmp_path / "demo")
    assert result.returncode == 0, result.stderr
    assert "half-way between two" in result.stdout
    names = {path.name for path in (tmp_path / "demo").iterdir()}
    assert names == {"pem.zarr", "metrics.json", "contact-sheet.png", "references", "viewer"}


@pytest.mark.parametrize("view", ["2", "-0.5", "0,0"])
def test_render_refuses_points_outside_of_the_space(baked: Path, tmp_path: Path, view: str) -> None:
    result = run("render", baked, "--view", view, "--out", tmp_path / "view.exr")
    assert result.returncode == 2
    assert "view" in result.stderr
    assert not (tmp_path / "view.exr").exists()


@pytest.mark.parametrize("name", ["view.exr", "view.png"])
def test_render_writes_a_picture_of_any_view(baked: Path, tmp_path: Path, name: str) -> None:
    picture = tmp_path / name
    result = run("render", baked, "--view", "0.3", "--out", picture)
    assert result.returncode == 0, result.stderr
    pixels, channels = _core.load_image(str(picture))
    assert pixels.shape == (30, 40, 3)
    assert list(channels) == ["R", "G", "B"]
    assert np.isfinite(pixels).all()
    assert pixels.std() > 0.01
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_render_walks_from_end_to_end(baked: Path, tmp_path: Path) -> None:
    result = run("render", baked, "--frames", "2", "--out", tmp_path / "walk{}.exr")
    assert result.returncode == 0, result.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["walk0000.exr", "walk0001.exr"]
    run("render", baked, "--view", "1", "--out", tmp_path / "end.exr")
    assert (tmp_path / "end.exr").read_bytes() == (tmp_path / "walk0001.exr").read_bytes()


def test_render_exposes_pictures_for_displays(baked: Path, tmp_path: Path) -> None:
    darker, mapped = (tmp_path / name for name in ("darker.png", "mapped.png"))
    scene = picture_of(open_pem(baked), 0.5)
    for picture, options in ((darker, ("--exposure=-2",)), (mapped, ("--tone-map", "neutral"))):
        assert run("render", baked, "--view", "0.5", *options, "--out", picture).returncode == 0
    for picture, shown in ((darker, scene / 4), (mapped, tone_map(scene))):
        # Half a step of 8 bits, where sRGB is steepest in light.
        assert _core.load_image(str(picture))[0] == pytest.approx(np.clip(shown, 0, 1), abs=0.005)
    result = run("render", baked, "--view", "0.5", "--exposure", "1", "--out", tmp_path / "a.exr")
    assert_one_error(result, "an .exr holds scene-linear radiance", status=EXIT_USAGE)


@pytest.mark.parametrize("views", ["views.kind=none", "views.count=1"])
def test_a_contact_sheet_of_any_parameter_space(tmp_path: Path, views: str) -> None:
    pem = tmp_path / "pem"
    assert run("bake", write_scene(tmp_path), "--out", pem, "--set", views).returncode == 0
    result = run("sheet", pem)
    assert result.returncode == 0, result.stderr
    pixels, _ = _core.load_image(str(pem / "contact-sheet.png"))
    assert min(pixels.shape[:2]) > 300
    assert pixels.std() > 0.1
    assert_one_error(run("sheet", pem, "--out", tmp_path / "a.gif"), "a name that ends in .png")


@pytest.mark.parametrize(
    ("view", "name", "status", "words"),
    [
        ("-0.1", "a.png", 2, ["view = -0.1", "from 0 to 1"]),
        ("1.01", "a.png", 2, ["view = 1.01"]),
        ("nan", "a.png", 2, ["view = nan"]),
        ("0.5", "a.gif", 3, ["a.gif", "expected a name that ends in .exr or .png"]),
        ("0.5", "missing/a.png", 3, ["missing/a.png", "cannot write"]),
    ],
)
def test_render_rejects_what_it_cannot_do(
    baked: Path, tmp_path: Path, view: str, name: str, status: int, words: list[str]
) -> None:
    result = run("render", baked, f"--view={view}", "--out", tmp_path / name)
    assert_one_error(result, *words, status=status)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_without_a_pem_is_one_clear_error(tmp_path: Path) -> None:
    assert_one_error(run("evaluate", tmp_path), "holds no PEM")
    assert_one_error(run("evaluate", tmp_path / "nowhere"), "holds no PEM")


def test_inputs_that_changed_since_the_bake_are_one_clear_error(tmp_path: Path) -> None:
    sky = tmp_path / "sky.exr"
    _core.save_image(str(sky), np.full((4, 8, 3), 0.5, np.float32), ["R", "G", "B"])
    options = ["--set", f"surroundings.panorama={sky}", "--views", "1"]
    result = run("bake", write_scene(tmp_path), "--out", tmp_path / "pem", *options)
    assert result.returncode == 0, result.stderr
    _core.save_image(str(sky), np.full((4, 8, 3), 0.6, np.float32), ["R", "G", "B"])
    assert_one_error(run("evaluate", tmp_path / "pem"), "its scene has changed", "surroundings.panorama")
    sky.unlink()
    assert_one_error(run("evaluate", tmp_path / "pem"), "sky.exr", "cannot read")
