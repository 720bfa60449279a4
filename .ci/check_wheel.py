"""Checks that a wheel holds the package and nothing else, and that it works as it lies.

Usage: python .ci/check_wheel.py FILE.whl
"""

import os
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

PROGRAMS = ("mb-envmap", "mb-fresnel", "mb-infer", "mb-trace")


def main(wheel: Path) -> None:
    with tempfile.TemporaryDirectory() as target:
        with zipfile.ZipFile(wheel) as archive:
            names = archive.namelist()
        pip = (sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check")
        subprocess.run(
            [*pip, "install", "--no-deps", "--prefix", target, "--ignore-installed", wheel], check=True
        )
        package = sysconfig.get_path("platlib", vars={"base": target, "platbase": target})
        foreign = [name for name in names if not name.startswith(("mirrorbake/", "mirrorbake-"))]
        development = [name for name in names if name.endswith((".a", ".hpp", ".cmake", ".cpp"))]
        if foreign or development:
            sys.exit(f"{wheel}: should hold the Python package alone, holds {foreign + development}")
        for needed in (
            "mirrorbake/py.typed",
            "mirrorbake/_core.pyi",
            "mirrorbake/libmirrorbake_openimageio.so",
            "mirrorbake/viewer/page/viewer.js",
            "mirrorbake/viewer/page/viewer.css",
        ):
            if needed not in names:
                sys.exit(f"{wheel}: lacks {needed}")
        # -S keeps this environment's editable installation away; the dependencies still come from it.
        path = os.pathsep.join((package, sysconfig.get_path("purelib"), sysconfig.get_path("platlib")))
        # A PNG is read by the library that the extension module loads.
        code = (
            "import mirrorbake, mirrorbake._core as c, numpy;"
            "print(mirrorbake.__file__, c.__file__, c.version());"
            f"c.save_image({target!r} + '/a.png', numpy.ones((2, 4, 3), numpy.float32));"
            f"assert c.load_image({target!r} + '/a.png')[0].shape == (2, 4, 3)"
        )
        output = subprocess.run(
            [sys.executable, "-S", "-c", code],
            env={**os.environ, "PYTHONPATH": path},
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split()
        if not all(file.startswith(target) for file in output[:2]):
            sys.exit(f"{wheel}: imported {output[:2]} instead of the wheel's files")
        for program in PROGRAMS:
            run = subprocess.run(
                [f"{target}/bin/{program}", "--version"], check=True, capture_output=True, text=True
            )
            if run.stdout.split()[-1] != output[2]:
                sys.exit(f"{wheel}: {program} is of version {run.stdout}, the package of {output[2]}")
        # The programs find that library, too.
        convert = ("convert", f"{target}/a.png", "--to", "cube", "-o", f"{target}/a.exr")
        subprocess.run([f"{target}/bin/mb-envmap", *convert], check=True)
        print(f"{wheel.name}: {len(names)} files, version {output[2]}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
