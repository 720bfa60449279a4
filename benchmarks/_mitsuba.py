"""Mitsuba as a peer: its compiled variants where they run, and a sentence where they do not."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

OLDEST_LLVM = 17
"""Dr.Jit writes programs that older ones do not understand: they abort, and the process with them."""

PROBE = """
import mitsuba
mitsuba.set_variant("llvm_ad_rgb")
assert list(mitsuba.Float([1.0, 2.0]) + 1) == [2.0, 3.0]
"""


def llvm_version(path: Path) -> int | None:
    """Of a library, as Debian names it: libLLVM-15.so.1, libLLVM-14.0.6.so.1, libLLVM.so.19.1."""
    version = re.match(r"libLLVM(?:-|\.so\.)(\d+)", path.name)
    return int(version[1]) if version else None


def installed_llvm() -> Path | None:
    """DRJIT_LIBLLVM_PATH, else the newest LLVM in Debian's folders that Dr.Jit can use."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return Path(os.environ["DRJIT_LIBLLVM_PATH"])
    folders = (*Path("/usr/lib").glob("*-linux-gnu"), *Path("/usr/lib").glob("llvm-*/lib"))
    found = [
        (version, path)
        for folder in folders
        for path in folder.glob("libLLVM*.so*")
        if (version := llvm_version(path)) is not None and version >= OLDEST_LLVM
    ]
    return max(found)[1] if found else None


@cache
def compiled_variant_fails() -> str | None:
    """Why `llvm_ad_rgb` does not run here, or None. Tried in another process, which it may take down."""
    library = installed_llvm()
    if library is None:
        return f"no LLVM {OLDEST_LLVM} or newer is installed (on Debian: apt install libllvm19)"
    version = llvm_version(library.resolve())
    if version is not None and version < OLDEST_LLVM:
        return f"{library} is LLVM {version}, and it needs {OLDEST_LLVM} or newer"
    environment = {**os.environ, "DRJIT_LIBLLVM_PATH": str(library)}
    trial = subprocess.run(
        [sys.executable, "-c", PROBE], env=environment, capture_output=True, text=True, check=False
    )
    if trial.returncode == 0:
        os.environ["DRJIT_LIBLLVM_PATH"] = str(library)
        return None
    said = trial.stderr.strip().splitlines() or [f"exit status {trial.returncode}"]
    return f"with {library}: {said[-1]}"


def mitsuba(variant: str) -> Any:
    """The module, set to `variant`, or None, said on standard error, where it does not run."""
    reason = compiled_variant_fails() if variant.startswith("llvm") else None
    if reason is None:
        try:
            import mitsuba as module

            module.set_variant(variant)
        except Exception as error:
            reason = str(error)
        else:
            return module
    print(f"bench: without Mitsuba's {variant}: {reason}", file=sys.stderr)
    return None


if __name__ == "__main__":
    # For script/bench, which installs LLVM where there is none.
    sys.exit(installed_llvm() is None)
