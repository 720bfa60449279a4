"""`mirrorbake export`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Exposure, Folder, Threads, ToneMap
from mirrorbake.commands.progress import messages, progress
from mirrorbake.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mirrorbake.pem.export.map_sets import MapSet
    from mirrorbake.pem.export.web import WebOptions


MapsFolder = Annotated[
    Path | None,
    typer.Option("--maps", metavar="OUT", help="Folder for environment maps of other programs."),
]
MapFormat = Annotated[
    str, typer.Option("--format", metavar="ktx2|exr", help="Of --maps; ktx2 holds all levels in a file.")
]
MapConvention = Annotated[
    str,
    typer.Option(
        "--convention",
        metavar="NAME",
        help="Of --maps: threejs, unity, unreal, blender or godot: whose orientation.",
    ),
]
MapPrecision = Annotated[str, typer.Option("--precision", metavar="half|float32", help="Of --maps.")]
GlbFile = Annotated[
    Path | None,
    typer.Option("--glb", metavar="OUT.glb", help="A glTF file with the mesh, its material and the maps."),
]
VideoFile = Annotated[
    Path | None,
    typer.Option("--video", metavar="OUT.mp4", help="A film along the first axis of the parameter space."),
]
StillFiles = Annotated[
    Path | None,
    typer.Option("--stills", metavar="OUT{}.png", help="The same as pictures, .png or .exr; {}: number."),
]
FrameCount = Annotated[
    int | None,
    typer.Option("--frames", metavar="N", help="Of --video and --stills. [default: one per sample]"),
]
FrameRate = Annotated[int, typer.Option("--fps", metavar="N", help="Frames per second of --video.")]
MapSample = Annotated[
    int | None,
    typer.Option(
        "--sample",
        metavar="I",
        help="This sample's maps: with --maps alone, with --glb beside the static.",
    ),
]
AllSamples = Annotated[bool, typer.Option("--all", help="The static maps and those of all samples.")]
WebFolder = Annotated[
    Path | None,
    typer.Option("--web", metavar="OUT", help="Folder for a page that any web server can host."),
]
SingleFile = Annotated[
    bool, typer.Option("--single-file", help="Of --web: OUT is one HTML file, which works from disk.")
]
ExactImages = Annotated[
    bool, typer.Option("--exact", help="Of --web: images in WebP without loss, not AVIF.")
]
ImageQuality = Annotated[
    int, typer.Option("--quality", min=1, max=100, metavar="N", help="Of --web: of AVIF, 1 to 100.")
]
ExactFallback = Annotated[
    bool,
    typer.Option(
        help="Of --web: exact images as well, for browsers that show AVIF wrongly; not in a single file."
    ),
]
OnlyRead = Annotated[
    bool,
    typer.Option(
        "--trim/--no-trim",
        help="Of --web: of a sample only what views near it read, the rest from the static set.",
    ),
]
WithReferences = Annotated[
    bool, typer.Option(help="Of --web: the ray-traced pictures of the samples, to compare with.")
]


# Of which outputs an option is: given without any of them it would do nothing.
_OUTPUTS_OF = {
    "format": ("maps",),
    "convention": ("maps",),
    "precision": ("maps",),
    "sample": ("maps", "glb"),
    "all_samples": ("maps", "glb"),
    "fps": ("video",),
    "frames": ("video", "stills"),
    "exposure": ("video", "stills"),
    "tone": ("video", "stills"),
    "single_file": ("web",),
    "exact": ("web",),
    "quality": ("web",),
    "fallback": ("web",),
    "references": ("web",),
    "trim": ("web",),
}


def _check_uses(context: typer.Context) -> None:
    """Refuse options that what is written has no use for, and names that say something else."""
    values = context.params
    if all(values[name] is None for name in ("maps", "glb", "video", "stills", "web")):
        raise typer.BadParameter("nothing to write: give --maps, --glb, --video, --stills or --web")
    flags = {parameter.name: parameter.opts[0] for parameter in context.command.params}

    def given(name: str) -> bool:
        source = context.get_parameter_source(name)
        return source is not None and source.name == "COMMANDLINE"

    for name, outputs in _OUTPUTS_OF.items():
        if given(name) and all(values[output] is None for output in outputs):
            wanted = " or ".join(flags[output] for output in outputs)
            raise typer.BadParameter(f"{flags[name]} has no use without {wanted}")
    if values["sample"] is not None and values["all_samples"]:
        raise typer.BadParameter("--sample and --all exclude each other")
    if values["exact"] and given("quality"):
        raise typer.BadParameter("--exact and --quality exclude each other")
    glb, web, single = values["glb"], values["web"], values["single_file"]
    if glb is not None and Path(glb).suffix.lower() != ".glb":
        raise OptionError(f"--glb = {glb}: expected a name that ends in .glb")
    if web is not None and single != (Path(web).suffix.lower() in (".html", ".htm")):
        wanted = "a name that ends in .html" if single else "a folder's name, or --single-file with it"
        raise OptionError(f"--web = {web}: expected {wanted}")


@reports_errors
def export_command(
    context: typer.Context,
    directory: Folder,
    maps: MapsFolder = None,
    format: MapFormat = "ktx2",
    convention: MapConvention = "threejs",
    precision: MapPrecision = "half",
    glb: GlbFile = None,
    video: VideoFile = None,
    stills: StillFiles = None,
    frames: FrameCount = None,
    fps: FrameRate = 30,
    exposure: Exposure = 0.0,
    tone: ToneMap = "none",
    sample: MapSample = None,
    all_samples: AllSamples = False,
    web: WebFolder = None,
    single_file: SingleFile = False,
    exact: ExactImages = False,
    quality: ImageQuality = 93,
    fallback: ExactFallback = True,
    references: WithReferences = True,
    trim: OnlyRead = True,
    threads: Threads = 0,
) -> None:
    """Write a PEM for other programs: its maps, a glTF file, a film, pictures, a page that draws it."""
    _check_uses(context)
    with _core.ThreadLimit(threads):
        if maps is not None:
            _export_maps(directory, maps, format, convention, precision, sample, all_samples)
        if glb is not None:
            _export_glb(directory, glb, sample, all_samples)
        if video is not None or stills is not None:
            _export_pictures(directory, video, stills, frames, fps, exposure, tone)
        if web is not None:
            from mirrorbake.pem.export.images import ImageFormat
            from mirrorbake.pem.export.web import WebOptions

            options = WebOptions(ImageFormat(exact, quality), fallback and not single_file, references, trim)
            _export_page(directory, web, options, single_file)


def _export_maps(
    directory: Path,
    out: Path,
    format: str,
    convention: str,
    precision: str,
    sample: int | None,
    all_samples: bool,
) -> None:
    from mirrorbake.pem.export.map_sets import (
        axis_descriptions,
        fade_degrees,
        run_time_of,
        sample_set,
        static_set,
    )
    from mirrorbake.pem.export.maps import DESCRIPTION_NAME, export_maps
    from mirrorbake.pem.store import PemStore

    store = PemStore.open(directory)
    store.require_complete()

    def sets() -> Iterator[MapSet]:
        if sample is not None:
            yield sample_set(store, sample)
            return
        yield static_set(store)
        if all_samples:
            yield from (sample_set(store, i) for i in range(len(store.header.space)))

    export_maps(
        sets(),
        out,
        axes=axis_descriptions(store.header.space),
        origin=store.header.origin,
        run_time=run_time_of(store),
        fade_degrees=fade_degrees(store),
        format=format,
        convention=convention,
        precision=precision,
        report=_print_message,
    )
    _print_message(f"wrote {out / DESCRIPTION_NAME} and the maps that it names")


def _export_glb(directory: Path, out: Path, sample: int | None, all_samples: bool) -> None:
    from mirrorbake.files import check_writable
    from mirrorbake.pem.export.glb import export_glb
    from mirrorbake.pem.opened import built_scene
    from mirrorbake.pem.store import PemStore

    check_writable(out)
    store = PemStore.open(directory)
    store.require_complete()
    samples = [] if sample is None else [sample]
    if all_samples:
        samples = list(range(len(store.header.space)))
    export_glb(store, built_scene(store), out, samples=samples, report=_print_message)
    _print_message(f"wrote {out}")


def _export_pictures(
    directory: Path,
    video: Path | None,
    stills: Path | None,
    frames: int | None,
    fps: int,
    exposure: float,
    tone: str,
) -> None:
    from mirrorbake.pem.export.video import export_stills, export_video
    from mirrorbake.pem.opened import open_pem

    pem = open_pem(directory)
    with progress() as add_bar:
        if video is not None:
            export_video(
                pem,
                video,
                frames=frames,
                frames_per_second=fps,
                exposure=exposure,
                tone=tone,
                report=add_bar("video"),
            )
        if stills is not None:
            export_stills(pem, stills, frames=frames, exposure=exposure, tone=tone, report=add_bar("stills"))
    for out in (video, stills):
        if out is not None:
            _print_message(f"wrote {out}")


def _export_page(directory: Path, out: Path, options: WebOptions, single_file: bool) -> None:
    from mirrorbake.pem.export.source import export_source
    from mirrorbake.pem.export.web import WebPem
    from mirrorbake.pem.opened import open_pem
    from mirrorbake.viewer.export import write_folder, write_single_file

    source = export_source(open_pem(directory))
    write = write_single_file if single_file else write_folder
    with progress() as add_bar:
        written = write(WebPem(source, options), source.title, out, add_bar("export"))
    for note in source.notes:
        _print_message(f"note: {note}")
    _print_message(f"wrote {out}, {written / 1e6:.2f} MB")


def _print_message(text: str) -> None:
    messages.print(text, markup=False, soft_wrap=True)
