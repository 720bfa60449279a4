"""The exit status of every command: 2 for options, 3 for files, whichever program it is."""

import contextlib
import re
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from typer.testing import CliRunner

from mirrorbake import _core
from mirrorbake.commands.main import app
from mirrorbake.envmap import EnvMap
from programs import find_program

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
TOML = '[reflector]\nobject = "teapot"\n'

# Of a view with four lookups a pixel.
LAYERS = [
    "coverage",
    *(f"{layer}.{c}" for layer in ("fresnel", "specular_local", "specular_distant") for c in "RGB"),
    "specular_local.A",
    *(f"lookup.{n}.part" for n in range(4)),
    *(f"lookup.{n}.fresnel.{c}" for n in range(4) for c in "RGB"),
    *(
        f"lookup.{n}.{name}{change}.{axis}"
        for n in range(4)
        for name in ("position", "reflection")
        for change in ("", "_dx", "_dy")
        for axis in "XYZ"
    ),
]

# A command that would succeed, and options of it with values that they do not take.
COMMANDS = {
    "mb-trace beauty SCENE -o OUT.exr --size 4x4 --spp 1": [
        *(
            "--size 4",
            "--size 0x4",
            "--size 4x99999",
            "--crop 2x2",
            "--crop 9x9+0+0",
            "--spp 0",
            "--spp many",
        ),
        *(
            "--depth -1",
            "--seed -1",
            "--indirect cache",
            "--camera side",
            "--fov 0",
            "--fov nan",
            "--fov wide",
        ),
        *("--eye nan 0 0", "--eye 1 2", "--target inf 0 0", "--noise 2", "--noise nan", "--format half2"),
        *("--threads -1", "--colour red"),
    ],
    "mb-trace layers teapot-room -o OUT.exr --size 4x4 --spp 1": [
        *(
            "--reflector lake",
            "--reflector floor",
            "--reflector teapot --reflector teapot",
            "--size 4x",
            "--fov 180",
        ),
        *("--depth 65", "--indirect some", "--format half2", "--lookups Fast"),
    ],
    "mb-infer LAYERS.exr -o OUT.exr --size 4": [
        *(
            "--size 3",
            "--size 0",
            "--size many",
            "--to latlong",
            "--run-time Fast",
            "--passes 0",
            "--passes 17",
        ),
        *("--shell near=infinite", "--shell distant", "--shell distant=cube", "--shell distant=sphere:0,0,0"),
        *("--shell distant=sphere:0,0,0,-1", "--shell distant=box:0,0,0,1,1,nan", "--shell local=infinite"),
        *("--shell distant=box:0,0,0,1,1,1@9,9,9", "--smoothness -1", "--level-agreement nan"),
        *(
            "--reflector lake",
            "--layer-weight -1",
            "--tolerance 0",
            "--iterations -1",
            "--format half2",
            "--threads -1",
        ),
    ],
    "mb-trace capture SCENE -o OUT.exr --size 4 --spp 1": [
        *(
            "--to globe",
            "--to fisheye:400",
            "--size 0",
            "--size 4x8",
            "--origin nan 0 0",
            "--origin 1",
            "--hide lake",
        ),
        *("--layout heap", "--layout files", "--format half2", "--crop 1x1+0+0"),
    ],
    "mb-envmap info MAP.exr": [
        "--from globe",
        "--from-layout heap",
        "--from-convention blender",
        "--threads 1025",
    ],
    "mb-envmap convert MAP.exr --to cube -o OUT.exr": [
        *(
            "--from globe",
            "--to globe",
            "--to fisheye:0",
            "--size 0",
            "--size 4x",
            "--size 4x8",
            "--filter sinc",
        ),
        *("--layout heap", "--layout files", "--to-convention blender", "--format half2", "--turn nan"),
        *("--from-layout heap", "--from-convention blender"),
    ],
    "mb-envmap mips MAP.exr -o OUT_{}.exr": [
        "--filter sinc",
        "--from globe",
        "--format half2",
        "--layout heap",
    ],
    "mb-envmap border MAP.exr -o OUT.exr": ["--width -1", "--width 99", "--width wide", "--layout heap"],
    "mb-envmap sample MAP.exr --direction 0 0 1": [
        *("--filter sinc", "--footprint 180", "--footprint nan", "--direction 0 0", "--direction 0 0 0"),
        *("--direction nan 0 0", "--from globe"),
    ],
    "mb-envmap compare MAP.exr MAP.exr": ["--from globe", "--from-layout heap", "--from-convention blender"],
    "mb-fresnel table --ior 1.5": [
        *(
            "--model phong",
            "--ior -1",
            "--ior nan",
            "--size -1",
            "--size 1",
            "--max-error 0",
            "--max-error nan",
        ),
        *("--model schlick --r0 2", "--model conductor --k -1", "--model conductor --eta 0"),
        *("--model metal --metal mithril", "--model metal --illuminant F2", "--threads -1"),
    ],
    "mb-fresnel plot --ior 1.5": [
        "--model phong",
        "--ior 0",
        "--model schlick --r0 -1",
        "--model metal --metal tin2",
    ],
    "mb-fresnel metal gold": ["--illuminant F2"],
    "mb-fresnel report --max-error 0.01": ["--max-error 0", "--max-error nan"],
    "mirrorbake analyze TOML --size 8x8": [
        *(
            "--views 0",
            "--views many",
            "--size 8",
            "--size 0x8",
            "--spp 0",
            "--em-size 3",
            "--seed -1",
            "--threads -1",
        ),
        *("--set maps.size", "--set maps.size=3", "--set maps.sise=4", "--set views.fov=nan", "--colour red"),
        *("--set material.metal=tofu", "--set seed=1"),
    ],
    "mirrorbake bake TOML --out OUT": ["--views 0", "--size 8", "--em-size 3", "--set trace.depth=65"],
    "mirrorbake render OUT --out OUT.png --view 0.5": [
        "--view nan",
        "--view half",
        "--threads 1025",
    ],
    "mirrorbake evaluate OUT": ["--threads 1025", "--colour red"],
    "mirrorbake study fresnel": ["--max-error 0", "--max-error nan", "--samples 1", "--threads -1"],
    "mirrorbake study proxy": ["--samples 1", "--seed -1"],
}

# Commands on files that are missing, damaged, of another kind or not to be written.
FILES = [
    *(
        "mb-trace beauty NONE.obj -o OUT.exr",
        "mb-trace beauty JUNK.obj -o OUT.exr",
        "mb-trace beauty MAP.exr -o OUT.exr",
    ),
    *("mb-trace beauty SCENE -o OUT.doc", "mb-trace beauty SCENE -o NONE/OUT.exr"),
    *("mb-trace beauty SCENE -o OUT.exr --sky NONE.exr", "mb-trace beauty SCENE -o OUT.exr --sky JUNK.exr"),
    "mb-trace beauty SCENE -o OUT.exr --sky NAN.exr",
    *(
        "mb-trace layers NONE.obj -o OUT.exr",
        "mb-trace layers SCENE -o OUT.exr",
        "mb-trace layers SCENE -o OUT.doc",
    ),
    *("mb-trace capture NONE.obj -o OUT.exr", "mb-trace capture SCENE -o OUT.doc"),
    *(
        "mb-infer NONE.exr -o OUT.exr",
        "mb-infer JUNK.exr -o OUT.exr",
        "mb-infer MAP.exr -o OUT.exr",
        "mb-infer LAYERS.exr -o OUT.exr --run-time Web1",
        "mb-infer LAYERS.exr -o OUT.png",
        "mb-infer LAYERS.exr -o NONE/OUT.exr",
    ),
    *(
        "mb-envmap info NONE.exr",
        "mb-envmap info JUNK.exr",
        "mb-envmap info NONE.ktx2",
        "mb-envmap info SCENE",
    ),
    *("mb-envmap convert NONE.exr --to cube -o OUT.exr", "mb-envmap convert MAP.exr --to cube -o OUT.doc"),
    *(
        "mb-envmap convert MAP.exr --to cube -o NONE/OUT.exr",
        "mb-envmap convert ODD.exr --to cube -o OUT.exr",
    ),
    *("mb-envmap mips NONE.exr -o OUT.ktx2", "mb-envmap mips MAP.exr -o OUT_{}.doc"),
    *("mb-envmap border NONE.exr -o OUT.exr", "mb-envmap border MAP.exr -o OUT.doc"),
    *("mb-envmap sample NONE.exr --direction 0 0 1", "mb-envmap compare MAP.exr NONE.exr"),
    *(
        "mb-envmap compare MAP.exr TWO.exr",
        "mb-fresnel table --output OUT.doc",
        "mb-fresnel plot --output NONE/OUT.svg",
    ),
    *("mirrorbake analyze NONE.toml", "mirrorbake analyze JUNK.toml", "mirrorbake analyze BAD.toml"),
    *("mirrorbake analyze BAD.toml --views 2", "mirrorbake analyze TOML --set reflector.mesh=NONE.obj"),
    *("mirrorbake bake NONE.toml --out OUT", "mirrorbake bake TOML --out JUNK.toml"),
    *("mirrorbake evaluate NONE", "mirrorbake render NONE --view 0.5 --out OUT.png"),
    *("mirrorbake render NONE --view 0.5 --out OUT.doc",),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files that commands read; nothing may appear beside them."""
    made = tmp_path_factory.mktemp("files")
    (made / "SCENE.obj").write_text(OBJ)
    (made / "scene.toml").write_text(TOML)
    (made / "BAD.toml").write_text(TOML + "[maps]\nsize = 3\n")
    for name in ("JUNK.obj", "JUNK.exr", "JUNK.toml"):
        (made / name).write_bytes(b"\x00\xffjunk")
    values = np.random.default_rng(1).random((8, 16, 3), np.float32)
    EnvMap.from_array(values, "latlong").save(made / "MAP.exr")
    EnvMap.from_array(values[..., :2], "latlong").save(made / "TWO.exr")
    EnvMap.from_array(np.full_like(values, np.nan), "latlong").save(made / "NAN.exr")
    EnvMap.from_array(values[:, :11], "latlong").save(made / "ODD.exr")
    nothing = [-1.0 if name.endswith("part") else 0.0 for name in LAYERS]
    _core.save_image(made / "LAYERS.exr", np.full((8, 8, len(LAYERS)), nothing, np.float32), LAYERS)
    return made


class Outcome(NamedTuple):
    status: int
    stdout: str
    stderr: str


def run(command: str, folder: Path) -> Outcome:
    program, *words = command.split()
    names = {"SCENE": "SCENE.obj", "TOML": "scene.toml"}
    words = [names.get(word, word) for word in words]
    if program == "mirrorbake":
        with contextlib.chdir(folder):
            told = CliRunner().invoke(app, words)
        return Outcome(told.exit_code, told.stdout, told.stderr)
    found = find_program(program)
    if found is None:
        pytest.skip(f"{program} is not built")
    done = subprocess.run(
        [found, *words], cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )
    return Outcome(done.returncode, done.stdout, done.stderr)


def assert_fails(command: str, folder: Path, status: int) -> Outcome:
    before = sorted(folder.iterdir())
    result = run(command, folder)
    assert result.status == status, (command, result.stderr)
    assert result.stdout == "", command
    assert result.stderr.strip(), command
    assert "Traceback" not in result.stderr, command
    assert sorted(folder.iterdir()) == before, command
    return result


def errors_of(outcome: Outcome) -> list[str]:
    """Return what is said beside warnings."""
    return [line for line in outcome.stderr.splitlines() if ": warning: " not in line]


@pytest.mark.parametrize(
    ("command", "option"), [(command, option) for command, options in COMMANDS.items() for option in options]
)
def test_a_value_that_an_option_does_not_take_is_exit_2(command: str, option: str, folder: Path) -> None:
    # The last word on an option counts, and --direction would only get a second one.
    name = option.split()[0]
    kept = re.sub(rf" {name}( (?!-)\S+)+", "", command)
    assert len(errors_of(assert_fails(f"{kept} {option}", folder, 2))) == 1


@pytest.mark.parametrize("command", FILES)
def test_a_file_that_cannot_be_used_is_exit_3(command: str, folder: Path) -> None:
    assert_fails(command, folder, 3)


@pytest.mark.parametrize("program", ["mb-trace", "mb-envmap", "mb-fresnel", "mb-infer", "mirrorbake"])
@pytest.mark.parametrize("words", ["fly", "--fly"])
def test_an_unknown_command_is_exit_2(program: str, words: str, folder: Path) -> None:
    assert len(errors_of(assert_fails(f"{program} {words}", folder, 2))) == 1
