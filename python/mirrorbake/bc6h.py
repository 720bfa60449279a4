"""DDS files of BC6H blocks, a byte per texel: encoded by ISPC Texture Compressor, where it is installed."""

from __future__ import annotations

from importlib import import_module
from os import fspath
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import NDArray

    from mirrorbake.envmap import EnvMap

_LARGEST = 65504.0  # of float16


def save_bc6h(envmap: EnvMap, path: str | PathLike[str]) -> int:
    """Write a cube of three channels with all its levels as BC6H_UF16; `EnvMap.load` reads it.

    Parameters
    ----------
    envmap
        A cube. BC6H has neither alpha nor values below 0 or above 65504.
    path
        Ending in ``.dds``.

    Returns
    -------
    int
        How many values were clamped to 0 to 65504.

    Raises
    ------
    InvalidArgument
        For another projection, number of channels or extension, for NaN and infinite values, and if the
        encoder is not installed: it is the extra ``bc6h`` of this package.
    FileError
        If the path cannot be written.
    """
    layout = envmap.layout
    if not fspath(path).lower().endswith(".dds"):
        raise _core.InvalidArgument(f"path is {fspath(path)}, expected a .dds file for BC6H")
    if layout.projection != "cube" or layout.channels != 3:
        raise _core.InvalidArgument(
            f"envmap is {layout.projection} of {layout.channels} channels, expected a cube of 3 for BC6H"
        )
    if not np.isfinite(envmap.values).all():
        bad = int((~np.isfinite(envmap.values)).sum())
        raise _core.InvalidArgument(f"envmap has {bad} NaN or infinite values, expected finite ones")
    encode = _encoder()
    clamped = int(((envmap.values < 0) | (envmap.values > _LARGEST)).sum())
    blocks = [
        encode(np.clip(envmap.level(level)[face], 0, _LARGEST).astype(np.float16))
        for face in range(6)
        for level in range(layout.levels)
    ]
    _core.save_dds_bc6h(fspath(path), layout, b"".join(blocks))
    return clamped


def _encoder() -> Any:
    try:
        texcomp = import_module("ispc_texcomp")
    except ImportError:
        raise _core.InvalidArgument(
            "format is bc6h, expected another without the encoder: pip install 'mirrorbake[bc6h]'"
        ) from None
    settings = texcomp.BC6HEncSettings.from_profile("slow")

    def encode(image: NDArray[np.float16]) -> bytes:
        # Blocks are whole: the last ones repeat the last texels.
        height, width = (-(-side // 4) * 4 for side in image.shape[:2])
        whole = np.zeros((height, width, 4), np.float16)
        whole[..., :3] = np.pad(
            image, ((0, height - image.shape[0]), (0, width - image.shape[1]), (0, 0)), mode="edge"
        )
        surface = texcomp.RGBASurface(whole.tobytes(), width, height, width * 8)
        return bytes(texcomp.compress_blocks_bc6h(surface, settings))

    return encode
