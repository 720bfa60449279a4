"""The manual of the commands, docs/reference/command-line.md, against what the programs say of themselves."""

import os
import re
import subprocess
import sys

import pytest

from programs import ROOT, find_program

MANUAL = (ROOT / "docs" / "reference" / "command-line.md").read_text()
COMMANDS = [
    *(f"mb-trace {command}" for command in ("beauty", "layers", "capture")),
    *(
        f"mb-envmap {command}"
        for command in (
            "info",
            "convert",
            "rotate",
            "preview",
            "background",
            "mips",
            "border",
            "sample",
            "prefilter",
            "compare",
        )
    ),
    "mb-infer",
    *(f"mb-fresnel {command}" for command in ("table", "plot", "metal", "report")),
    *(
        f"mirrorbake {command}"
        for command in (
            "bake",
            "analyze",
            "evaluate",
            "report",
            "info",
            "sheet",
            "render",
            "verify",
            "export",
            "view",
            "demo",
        )
    ),
    *("mirrorbake study fresnel", "mirrorbake study proxy"),
]


def help_of(command: str) -> str:
    name, *words = command.split()
    program = find_program(name)
    if name != "mirrorbake" and program is None:
        pytest.skip(f"{name} is not built")
    start = [sys.executable, "-m", "mirrorbake"] if name == "mirrorbake" else [str(program)]
    wide = os.environ | {"COLUMNS": "200", "NO_COLOR": "1", "TERM": "dumb"}
    done = subprocess.run([*start, *words, "--help"], capture_output=True, text=True, check=True, env=wide)
    return done.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_is_in_the_manual(command: str) -> None:
    options = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", help_of(command))) - {"--help"}
    assert options or command == "mirrorbake verify", command
    section = MANUAL.split(f"\n## {command.split()[0]}\n")[-1].split("\n## ")[0]
    if command.startswith("mirrorbake"):
        section = MANUAL.split("\n## ")[0]
    common = {"--threads", "--json", "--version", "--output"}
    missing = {option for option in options - common if option not in section}
    assert not missing
    assert not {option for option in options if option not in MANUAL}


@pytest.mark.parametrize("program", ["mb-trace", "mb-envmap", "mb-fresnel", "mirrorbake"])
def test_the_commands_above_are_all(program: str) -> None:
    text = help_of(program)
    listed = re.findall(
        r"^(?:│ |  )([a-z]+) {2,}", re.split(r"[Ss]ubcommands:|Commands", text)[-1], re.MULTILINE
    )
    assert set(listed) == {command.split()[1] for command in COMMANDS if command.split()[0] == program}
