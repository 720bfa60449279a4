"""The examples in the documentation: where they are, and what the commands in them would run."""

from __future__ import annotations

import json
import os
import re
import subprocess
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING

from programs import ROOT

if TYPE_CHECKING:
    from pathlib import Path

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]

# Python's dialect of regular expressions: the closing fence is indented as the opening one is.
FENCE = re.compile(r"^(?P<indent> *)```(?P<language>\w*)[^\n]*\n(?P<text>.*?)^(?P=indent)```$", re.M | re.S)


@dataclass(frozen=True)
class Snippet:
    """A fenced block of a page."""

    page: str
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        """Return the place, as the tests are named."""
        return f"{self.page}:{self.line}"


def all_snippets() -> list[Snippet]:
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for block in FENCE.finditer(text):
            line = text.count("\n", 0, block.start()) + 2
            body = textwrap.dedent(block["text"])
            found.append(Snippet(str(page.relative_to(ROOT)), line, block["language"], body))
    return found


# Appends its own name and its arguments to a log, as a line of JSON.
RECORDER = """#!/usr/bin/env python3
import json, os, sys
with open(os.environ["SNIPPET_LOG"], "a") as log:
    log.write(json.dumps(sys.argv) + "\\n")
"""


def recorded_commands(script: str, folder: Path, programs: list[str]) -> list[list[str]]:
    """Run a shell script in which every program only notes how it was called.

    So Bash itself reads the script: its comments, quotes, variables and continued lines. A program that is
    none of those given is an error, as it is for whoever copies the example.

    Parameters
    ----------
    script
        For ``bash -eu``.
    folder
        Where it runs. Programs whose name has a slash are made in it.
    programs
        Names, as the script may call them.

    Returns
    -------
    list
        For every call the program's name and its arguments.
    """
    shims, log = folder / "shims", folder / "shims.log"
    log.write_text("")
    for name in programs:
        shim = (folder if "/" in name else shims) / name
        shim.parent.mkdir(parents=True, exist_ok=True)
        shim.write_text(RECORDER)
        shim.chmod(0o755)
    path = f"{shims}:{os.environ['PATH']}"
    # What a cluster sets for the jobs that it starts.
    environment = {"PATH": path, "HOME": str(folder), "SNIPPET_LOG": str(log), "SLURM_ARRAY_TASK_ID": "0"}
    done = subprocess.run(
        ["bash", "-eu", "-c", script],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    calls = [json.loads(line) for line in log.read_text().splitlines()]
    return [[program.removeprefix(f"{shims}/"), *arguments] for program, *arguments in calls]
