"""The report of a PEM: one HTML file that needs nothing else."""

from __future__ import annotations

import html
import math
import platform
import sys
from importlib import metadata, resources
from typing import TYPE_CHECKING

from mirrorbake import _core
from mirrorbake.errors import OptionError
from mirrorbake.evaluate.contenders import MAIN_RUN_TIME, RUN_TIMES, TITLES
from mirrorbake.evaluate.evaluate import Evaluation, SeenView, evaluate, finite
from mirrorbake.evaluate.metrics import mean_or_none
from mirrorbake.evaluate.places import PLACE_TITLES
from mirrorbake.evaluate.report.pictures import Plot, colour, error_url, legend, picture_url
from mirrorbake.evaluate.table import METRIC_DIGITS, METRIC_TITLES, number, present
from mirrorbake.files import check_writable, write_text
from mirrorbake.pem.location import Location, bytes_under
from mirrorbake.pem.store import PemStore

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from mirrorbake.bake.bake import ProgressReport
    from mirrorbake.scene.stage import Stage

REPORT_NAME = "report.html"
PICTURED = ("on", "between", "off_5", "above_10", "dome")
"""Places of which a report has pictures: the first view of each."""


def report(
    directory: Location | Path | str,
    out: Path | None = None,
    progress: ProgressReport | None = None,
    stage: Stage | None = None,
    sections: Iterable[Callable[[Path], str]] = (),
) -> Path:
    """Evaluate a PEM and write a report of it: a page that needs no other file and no network.

    Parameters
    ----------
    directory
        A folder or URL with a complete PEM.
    out
        The HTML file; default: `DIR/report.html` of a folder.
    progress
        Told about every view.
    stage
        The PEM's scene, if it has been prepared already.
    sections
        What makes further sections of a PEM's folder, which a URL is not: HTML, or nothing.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        It cannot be written to; found out before the evaluation.
    OptionError
        The PEM is at a URL, and `out` is not given.
    StoreError
        As `evaluate` raises it.
    """
    location = Location.of(directory)
    if out is None:
        if location.is_remote:
            raise OptionError(f"{location}: a report is written to this machine; expected --out FILE")
        out = location.path / REPORT_NAME
    check_writable(out)
    pictured: dict[str, SeenView] = {}

    def keep(seen: SeenView) -> None:
        if seen.view.place in PICTURED:
            pictured.setdefault(seen.view.place, seen)

    evaluation = evaluate(location, progress, stage, on_view=keep)
    store = PemStore.open(location)
    # That which the maps were inferred for, and which pictures are drawn by, comes first.
    own = next((seen.run_time for seen in pictured.values()), MAIN_RUN_TIME)
    run_times = sorted(RUN_TIMES, key=lambda name: name != own)
    parts = [
        _head(store, evaluation, own),
        _table(evaluation, run_times),
        _curves(evaluation, run_times),
        _pictures(pictured),
        _metrics(evaluation, run_times),
        *(section(location.path) for section in sections if not location.is_remote),
        _plan(store),
        _cost(store, evaluation),
        _about(store, evaluation),
    ]
    write_text(out, _page(f"mirrorbake: {_name(store)}", "\n".join(part for part in parts if part)))
    return out


def _page(title: str, body: str) -> str:
    folder = resources.files("mirrorbake.evaluate.report")
    style, script = ((folder / name).read_text(encoding="utf-8") for name in ("style.css", "script.js"))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title>\n<style>\n{style}</style></head>\n"
        f"<body>\n{body}\n<script>\n{script}</script></body></html>\n"
    )


def _name(store: PemStore) -> str:
    reflector = store.header.source.config["reflector"]
    name = reflector["object"] or reflector["scene_object"] or reflector["mesh"]
    return str(name).replace("\\", "/").rsplit("/", 1)[-1]


def _head(store: PemStore, evaluation: Evaluation, run_time: str) -> str:
    header, views = store.header, store.header.source.config["views"]
    width, height = header.image_size
    lines = [
        f"<h1>{html.escape(_name(store))}</h1>",
        f'<p class="lead">{html.escape(verdict(evaluation, run_time))}</p>',
    ]
    count = len(header.space)
    lines.append(
        f'<p class="soft">{count} view{"s" * (count != 1)} over {abs(views["degrees"]):g}°, {width}×{height} '
        f"pixels, maps of {header.sizes_in_words} ×{header.faces} texels with all their levels.</p>"
    )
    lines += [f'<p class="soft">Note: {html.escape(note)}.</p>' for note in evaluation.notes]
    return "\n".join(lines)


def verdict(evaluation: Evaluation, run_time: str) -> str:
    """One or two sentences on what the figures of a run time say."""

    def mean(contender: str, place: str) -> float | None:
        return evaluation.mean(contender, place, run_time=run_time)

    names = present(evaluation)
    static = [name for name in names if name.startswith("static")]
    on, between = (mean("pem", place) for place in ("on", "between"))
    if on is None or not static:
        return "The object covers no pixel of the evaluated views wholly: there is nothing to measure."
    best = max(static, key=lambda name: mean(name, "on") or -math.inf)
    there = mean(best, "on")
    assert there is not None
    words = f"The PEM agrees with ray tracing to {on:.1f} dB on its samples"
    words += "" if between is None else f" and {between:.1f} dB between them"
    words += f"; the best static map ({_lowered(TITLES[best])}) to {there:.1f} dB. Run time: {run_time}."
    worse = [
        place
        for place in evaluation.places
        if (mean("pem", place) or math.inf) < (mean(best, place) or -math.inf)
    ]
    if on < there + 1.0:
        words += " That is no lead worth the bytes of a PEM: the static map does as well here."
    elif worse:
        words += f" The static map is the better one {', '.join(PLACE_TITLES[place] for place in worse)}."
    return words


def _lowered(title: str) -> str:
    return title[:1].lower() + title[1:]


def _rows(heading: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in heading)
    body = "\n".join("<tr>" + "".join(rows_cells) + "</tr>" for rows_cells in rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>'


def _cell(words: str, kind: str = "") -> str:
    return f'<td class="{kind}">{html.escape(words)}</td>' if kind else f"<td>{html.escape(words)}</td>"


def _table(evaluation: Evaluation, run_times: Sequence[str]) -> str:
    names = present(evaluation)
    parts = ["<h2>Against ray tracing</h2>", f'<p class="soft">{html.escape(_YARDSTICK)}</p>']
    for run_time in run_times:
        rows = []
        for place in evaluation.places:
            views = [view for view in evaluation.views if view.place == place]
            values = [evaluation.mean(name, place, run_time=run_time) for name in names]
            best = max((value for value in values if value is not None), default=None)
            cells = [
                _cell(number(value, 1), "best" if value is not None and value == best else "")
                for value in values
            ]
            degrees = max(view.degrees for view in views)
            ceiling = mean_or_none([view.ceiling for view in views])
            rows.append(
                [_cell(PLACE_TITLES[place]), _cell(f"{degrees:.3g}°"), *cells, _cell(number(ceiling, 1))]
            )
        heading = ["PSNR, dB", "from a sample", *(TITLES[name] for name in names), "ceiling"]
        if len(run_times) > 1:
            parts.append(f"<h3>Run time {run_time}</h3>")
        parts.append(_rows(heading, rows))
    return "\n".join(parts)


_YARDSTICK = (
    "PSNR of what a display shows, over the pixels that the object covers wholly, against ray tracing with "
    "random numbers of its own. The ceiling is what the true image would have against that reference: its "
    "own noise, which has been taken off the other figures."
)


def _curves(evaluation: Evaluation, run_times: Sequence[str]) -> str:
    names = present(evaluation)
    along = [view for view in evaluation.views if view.place in _ALONG]
    others = [view for view in evaluation.views if view.place not in _ALONG]
    if len(along) < 2:
        return ""
    parts = ["<h2>Error against angle</h2>"]
    for run_time in run_times:
        values = [
            value
            for view in evaluation.views
            for name in names
            if (value := view.metrics["psnr"].get(name, {}).get(run_time)) is not None
        ]
        if not values:
            continue
        title = f"PSNR against degrees from the nearest sample; run time {run_time}"
        degrees = [view.degrees for view in evaluation.views]
        plot = Plot(degrees, values, ("degrees from the nearest sample", "dB"), title=title)
        # The first contender lies on top.
        for name in reversed(names):
            points = [
                (view.degrees, value)
                for view in sorted(along, key=lambda view: view.degrees)
                if (value := view.metrics["psnr"].get(name, {}).get(run_time)) is not None
            ]
            plot.curve(points, f'style="stroke:{colour(name)}" stroke-width="2"')
            for kind, views in (("solid", along), ("hollow", others)):
                for view in views:
                    value = view.metrics["psnr"].get(name, {}).get(run_time)
                    if value is not None:
                        fill = colour(name) if kind == "solid" else "var(--paper)"
                        style = f'style="fill:{fill};stroke:{colour(name)}" stroke-width="1.5"'
                        words = f"{TITLES[name]}, {PLACE_TITLES[view.place]}: {value:.1f} dB"
                        plot.point(view.degrees, value, style, words)
        if len(run_times) > 1:
            parts.append(f"<h3>Run time {run_time}</h3>")
        parts += [f'<div class="scroll">{plot.svg()}</div>', legend(names)]
    parts.append('<p class="soft">Lines: along the arc and past its end. Hollow: above and below it.</p>')
    return "\n".join(parts)


_ALONG = frozenset(place for place in PLACE_TITLES if place in ("on", "between") or place.startswith("off"))


def _pictures(pictured: dict[str, SeenView]) -> str:
    if not pictured:
        return ""
    scale = (
        '<p class="soft">Below each picture its error: <span class="scale"></span> '
        "0 to 0.25 of the display's range. Drag across a picture to compare.</p>"
    )
    cards = [_card(pictured[place]) for place in PICTURED if place in pictured]
    return "\n".join(["<h2>Side by side</h2>", scale, *cards])


def _card(seen: SeenView) -> str:
    reference, view, run_time = seen.reference, seen.view, seen.run_time
    true = reference.images.beauty
    names = list(seen.pictures)
    traced = picture_url(true)
    figures, buttons = [f'<figure><img alt="Ray traced" src="{traced}">Ray traced</figure>'], []
    first = ""
    for name in names:
        light = seen.pictures[name][run_time]
        picture = reference.images.composite(light)
        title, url = html.escape(TITLES[name]), picture_url(picture)
        first = first or url
        figures.append(
            f'<figure><img alt="{title}" data-name="{name}" src="{url}">'
            f'<img alt="Its error" src="{error_url(picture, true)}">'
            f"{title}: <b>{number(reference.psnr(light), 1)} dB</b></figure>"
        )
        pressed = "true" if name == names[0] else "false"
        buttons.append(f'<button type="button" data-name="{name}" aria-pressed="{pressed}">{title}</button>')
    about = f"{view.degrees:.3g}° from a sample · {reference.samples} samples per pixel"
    about += f" · ceiling {number(finite(reference.ceiling), 1)} dB"
    return (
        f'<section class="place"><header><h3>{html.escape(PLACE_TITLES[view.place].capitalize())}</h3>'
        f'<span class="soft">{about}</span></header>\n'
        f'<div class="compare"><img alt="Ray traced" src="{traced}">'
        f'<img class="over" alt="{html.escape(TITLES[names[0]])}" src="{first}"><span class="bar"></span>'
        f'<span class="tag left">{html.escape(TITLES[names[0]])}</span>'
        '<span class="tag right">Ray traced</span></div>\n'
        '<input class="slide" type="range" min="0" max="100" value="50" step="any" '
        'aria-label="How much of the left picture shows">\n'
        f'<div class="pick">{"".join(buttons)}</div>\n<div class="strip">{"".join(figures)}</div></section>'
    )


def _metrics(evaluation: Evaluation, run_times: Sequence[str]) -> str:
    rows = [
        [
            _cell(PLACE_TITLES[place]),
            _cell(run_time),
            *(
                _cell(number(evaluation.mean("pem", place, run_time=run_time, metric=metric), digits))
                for metric, digits in METRIC_DIGITS.items()
            ),
        ]
        for place in evaluation.places
        for run_time in run_times
    ]
    words = (
        "SSIM: 1 is best. FLIP: 0 is best. Worst 1 %: RMS error of those pixels, in display values. Sliding: "
        "error of the motion of reflections since the sample before."
    )
    heading = ["The PEM", "run time", *(METRIC_TITLES[metric] for metric in METRIC_DIGITS)]
    return f'<h2>By every metric</h2>\n<p class="soft">{words}</p>\n{_rows(heading, rows)}'


def _plan(store: PemStore) -> str:
    rows = []
    for decision in store.header.plan.decisions:
        value = str(decision.value).lower() if isinstance(decision.value, bool) else str(decision.value)
        reason = decision.reason if decision.part is None else f"{decision.part}: {decision.reason}"
        rows.append([_cell(decision.key), _cell(value), _cell(reason, "words")])
    advice = [f'<p class="soft">{html.escape(_sentence(words))}</p>' for words in store.header.plan.advice]
    table = _rows(["key", "value", "reason"], rows)
    return "\n".join(["<h2>What was decided, and why</h2>", *advice, table, law_section(store)])


def law_section(store: PemStore) -> str:
    """Return what was measured to decide how far apart the maps are, as HTML; nothing where it was not."""
    law = store.header.plan.law
    if law is None:
        return ""
    trials = sorted(law.trials, key=lambda trial: (trial.degrees, trial.traced))
    degrees, decibels = [trial.degrees for trial in trials], [trial.decibels for trial in trials]
    plot = Plot(
        degrees, decibels, ("degrees between maps", "dB"), title="PSNR between maps, by their spacing"
    )
    fractions = [number / 60.0 for number in range(61)]
    along = [degrees[0] * (degrees[-1] / degrees[0]) ** fraction for fraction in fractions]
    plot.curve([(at, law.decibels(at)) for at in along], 'style="stroke:var(--ink)" stroke-width="2"')
    for trial in trials:
        words = f"{trial.degrees:.3g} degrees, {trial.traced} traced views in a cell: {trial.decibels:.1f} dB"
        plot.point(trial.degrees, trial.decibels, 'style="fill:var(--ink)"', words)
    rows = [
        [_cell(f"{trial.degrees:.3g}°"), _cell(str(trial.traced)), _cell(f"{trial.decibels:.1f} dB")]
        for trial in trials
    ]
    table = _rows(["between maps", "traced views in a cell", "views that were in no fit"], rows)
    chart = f'<div class="scroll">{plot.svg()}</div>' if degrees[-1] > degrees[0] else ""
    words = html.escape(_sentence(str(law)))
    return f'<h3>The law of spacing</h3>\n<p class="soft">{words}</p>\n{chart}\n{table}'


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:] + "."


def megabytes(count: float) -> str:
    """Words for a number of bytes."""
    return f"{count / 1e6:.3g} MB" if count >= 1e6 else f"{count / 1e3:.3g} kB"


def _cost(store: PemStore, evaluation: Evaluation) -> str:
    count = len(store.header.space)
    timings = [store.read_timings(index) for index in range(count)]
    maps = sum(store.map_bytes(index) for index in range(count))
    # A web server lists no files, so that nobody knows.
    whole = bytes_under(store.location.store(writable=False), "")
    rows = [
        ("tracing", f"{sum(t.trace_s for t in timings) / count:.2f} s a view"),
        ("building matrices", f"{sum(t.build_s for t in timings) / count:.2f} s a view"),
        ("solving", f"{sum(t.solve_s for t in timings) / count:.2f} s a view"),
        ("maps on disk", f"{megabytes(maps)}, {megabytes(maps / count)} a view"),
        *([("the whole PEM on disk", megabytes(whole))] if whole else []),
        ("references traced", f"{sum(view.seconds for view in evaluation.views):.1f} s"),
    ]
    return "<h2>Time and bytes</h2>\n" + _rows(["what", "cost"], [[_cell(a), _cell(b)] for a, b in rows])


def _about(store: PemStore, evaluation: Evaluation) -> str:
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "zarr", "scikit-image"))
    machine = f"{platform.machine()}, {_core.active_isa()}, {_core.thread_count()} threads"
    fingerprint = store.header.fingerprint[:16]
    return (
        '<h2>About this report</h2>\n<p class="soft">'
        f"Baked by mirrorbake {html.escape(store.header.source.library)}, reported by {_core.version()} "
        f"({machine}; Python {sys.version.split()[0]}, {versions}). PEM {fingerprint}. "
        f"Display: {html.escape(evaluation.header['display_transform'])}.</p>"
    )
