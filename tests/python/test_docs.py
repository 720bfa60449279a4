"""Every example of the documentation that can run runs; the others say why not.

Each stands alone: it runs in a folder of its own, with the files that its text takes for granted.
"""

from __future__ import annotations

import importlib
import json
import re
import shutil
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import typer
from click import Group
from typer.main import get_command
from typer.testing import CliRunner

import mirrorbake
from mirrorbake.bake.bake import bake
from mirrorbake.commands.main import app
from mirrorbake.envmap import EnvMap
from mirrorbake.scene.build import build_scene
from mirrorbake.scene.load import load_config, parse_config
from programs import ROOT, find_program, run_program
from snippets import Snippet, all_snippets, recorded_commands

from .gltf_scene import SQUARE, SQUARE_TRIANGLES, GlbScene

if TYPE_CHECKING:
    from pathlib import Path

SNIPPETS = all_snippets()
CANNOT_RUN = {
    "csharp": "needs Unity",
    "gdscript": "needs Godot",
    "text": "formulas, or what a command prints",
    "markdown": "a template to fill in",
}

TINY: dict[str, dict[str, Any]] = {
    "reflector": {"object": "teapot", "subdivisions": 3, "parts": "split"},
    "views": {"count": 2, "size": [32, 32]},
    "maps": {"size": 8},
    "trace": {"samples": 1, "indirect": "none"},
}
TINY_TOML = "\n".join(
    f"{section}.{key} = {json.dumps(value)}" for section, keys in TINY.items() for key, value in keys.items()
)
QUICK = {"--spp": "16", "--size": "16x12"}
"""Of mb-trace, instead of what an example says: the same options, in less time."""

SCRIPTS = [str(path.relative_to(ROOT)) for path in (ROOT / "script").iterdir()] + [".ci/run"]
TOOLS = ["mb-envmap", "mb-fresnel", "mb-infer", "mb-trace"]
BUILDERS = ["cmake", "ctest", ".venv/bin/python"]
FUZZERS = [
    f"build/fuzz/tests/fuzz/{name}"
    for name in re.findall(
        r"\bfuzz_\w+", (ROOT / "tests" / "fuzz" / "CMakeLists.txt").read_text(encoding="utf-8")
    )
]
PROGRAMS = ["mirrorbake", *TOOLS, *SCRIPTS, *BUILDERS, *FUZZERS]


def examples(*languages: str) -> pytest.MarkDecorator:
    chosen = [snippet for snippet in SNIPPETS if snippet.language in languages]
    return pytest.mark.parametrize("snippet", chosen, ids=str)


@pytest.fixture(scope="session")
def small_pem(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("docs") / "pem"
    bake(parse_config(TINY, "tiny teapot"), folder)
    return folder


@pytest.fixture
def workplace(tmp_path: Path, small_pem: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which an example runs, with the files that readers have."""
    monkeypatch.chdir(tmp_path)
    light = np.full((64, 128, 3), 0.5, np.float32)
    for name in ("panorama.exr", "workshop.exr"):
        mirrorbake.save_image(name, light)
    EnvMap.from_array(light, "latlong").resample("cube", 32).save("cube.exr")
    EnvMap.load("cube.exr").mips().save("cube.ktx2")
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    (tmp_path / "bunny.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    kitchen = GlbScene(materials=[{"pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}}])
    square = kitchen.add_mesh(SQUARE, SQUARE_TRIANGLES, 0)
    kitchen.nodes = [
        {"name": name, "mesh": square, "translation": [0, y, 0]} for y, name in enumerate(["floor", "kettle"])
    ]
    for name in ("kitchen.glb", "bottle.glb"):
        kitchen.write(tmp_path / name)
    (tmp_path / "scene.toml").write_text(TINY_TOML.replace("count = 2", "count = 100"))
    for name in ("teapot", "bottle"):
        shutil.copytree(small_pem, tmp_path / "out" / name)
    (tmp_path / "examples").mkdir()
    for scene in (ROOT / "examples").glob("*.toml"):
        shutil.copy(scene, tmp_path / "examples")
    return tmp_path


def write_scenes_of(page: str, folder: Path) -> None:
    """Write the scene files that a page shows under the names that their first lines give them."""
    for snippet in SNIPPETS:
        name = re.match(r"# (\S+\.toml)\n", snippet.text)
        if snippet.page == page and snippet.language == "toml" and name:
            (folder / name[1]).write_text(snippet.text, encoding="utf-8")


def test_every_example_is_tested_or_says_why_not() -> None:
    tested = {"python", "toml", "sh", "json", "cpp", "cmake", "glsl"}
    unknown = [str(snippet) for snippet in SNIPPETS if snippet.language not in tested | set(CANNOT_RUN)]
    assert not unknown
    assert len(SNIPPETS) > 30


@examples(*CANNOT_RUN)
def test_an_example_for_other_programs_is_there(snippet: Snippet) -> None:
    assert snippet.text.strip()
    pytest.skip(CANNOT_RUN[snippet.language])


@examples("python")
@pytest.mark.usefixtures("workplace")
def test_a_python_example_runs_alone(snippet: Snippet) -> None:
    exec(compile(snippet.text, str(snippet), "exec"), {"__name__": "example"})


@examples("toml")
def test_a_scene_of_the_documentation_can_be_built(snippet: Snippet, workplace: Path) -> None:
    scene = workplace / "example.toml"
    scene.write_text(snippet.text, encoding="utf-8")
    config = load_config(scene)
    assert config != load_config(workplace / "scene.toml")
    assert len(build_scene(config).positions) > 0


@examples("json")
def test_json_of_the_documentation_is_json(snippet: Snippet) -> None:
    assert json.loads(snippet.text)


@examples("cpp", "cmake", "glsl")
def test_what_other_tests_compile_is_what_the_documentation_shows(snippet: Snippet) -> None:
    """C++ and CMake are tests/consumer, the shaders examples/web: each has tests that build and run it."""
    included = re.fullmatch(r'--8<-- "(.+)"', snippet.text.strip())
    if included:
        assert (ROOT / included[1]).is_file()
        return
    consumer = (ROOT / "tests" / "consumer" / "CMakeLists.txt").read_text(encoding="utf-8")
    names = re.findall(r"find_package\(mirrorbake|mirrorbake::\w+", snippet.text)
    assert names
    assert all(name in consumer for name in names)


def run_in_process(arguments: list[str]) -> None:
    result = CliRunner().invoke(app, arguments)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.stderr


def parse_only(arguments: list[str]) -> None:
    command, rest = get_command(app), list(arguments)
    while isinstance(command, Group):
        command = command.commands[rest.pop(0)]
    command.make_context(str(command.name), rest)


def try_mirrorbake(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    command = arguments[0]
    if command in {"view", "demo", "study"}:  # a server, and minutes of work
        parse_only(arguments)
        return

    def stop(*_args: object, **_options: object) -> None:
        raise typer.Exit

    if command in {"bake", "evaluate"}:  # which have read their files and all options when the work begins
        monkeypatch.setattr(importlib.import_module(f"mirrorbake.{command}.{command}"), command, stop)
    run_in_process(arguments)


def presets(kind: str) -> set[str]:
    file = json.loads((ROOT / "CMakePresets.json").read_text(encoding="utf-8"))
    return {preset["name"] for preset in file[f"{kind}Presets"]}


def try_builder(program: str, arguments: list[str]) -> None:
    """CMake's presets and targets are there: building takes minutes, and is what the other steps of CI do."""
    if program == ".venv/bin/python":
        assert arguments[:2] == ["-m", "nanobind.stubgen"], "not known to work"  # tested by test_stub.py
        return
    if "--preset" in arguments:
        kind = "test" if program == "ctest" else "build" if arguments[0] == "--build" else "configure"
        assert arguments[arguments.index("--preset") + 1] in presets(kind)
    if "--target" in arguments:
        target = arguments[arguments.index("--target") + 1]
        folder = ROOT / "tests" / "cpp" / target.removeprefix("test_")
        assert folder.is_dir() or any(fuzzer.endswith("/" + target) for fuzzer in FUZZERS), target


def try_script(program: str, arguments: list[str]) -> None:
    text = (ROOT / program).read_text(encoding="utf-8")
    for argument in arguments:
        assert argument in text, f"{program} knows no {argument}"


def try_tool(program: str, arguments: list[str]) -> None:
    if find_program(program) is None:
        pytest.skip(f"{program} is not built: cmake --build --preset dev --target {program}")
    if program == "mb-trace":
        for option, value in QUICK.items():
            if option in arguments:
                arguments[arguments.index(option) + 1] = value
    run_program(program, *arguments)


def test_commands_are_read_as_the_shell_reads_them_and_unknown_ones_are_errors(tmp_path: Path) -> None:
    script = 'first=3  # a comment\nmirrorbake bake "a b.toml" \\\n  --samples "$first:$((first + 2))"\n'
    assert recorded_commands(script, tmp_path, ["mirrorbake"]) == [
        ["mirrorbake", "bake", "a b.toml", "--samples", "3:5"]
    ]
    with pytest.raises(AssertionError, match="mirrorbaker"):
        recorded_commands("mirrorbaker info", tmp_path, ["mirrorbake"])


@examples("sh")
def test_the_commands_of_an_example_are_understood(
    snippet: Snippet, workplace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_scenes_of(snippet.page, workplace)
    calls = recorded_commands(snippet.text, workplace, PROGRAMS)
    assert calls
    for program, *arguments in calls:
        if program == "mirrorbake":
            try_mirrorbake(arguments, monkeypatch)
        elif program in TOOLS:
            try_tool(program, arguments)
        elif program in BUILDERS:
            try_builder(program, arguments)
        elif program in SCRIPTS:
            try_script(program, arguments)
        else:
            assert program in FUZZERS
