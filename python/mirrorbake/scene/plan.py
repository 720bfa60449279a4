"""What a bake does, decided before it starts: which layers, bounces, samples and maps (spec T6)."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from mirrorbake.scene.config_shells import Shells, ShellSection
from mirrorbake.scene.config_values import MAX_MAP_SIZE
from mirrorbake.scene.spacing_law import SpacingLaw

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.config_infer import Infer

DECIDED_KEYS = (
    "reflector.longest_edge",
    "reflector.parts",
    "trace.depth",
    "trace.samples",
    "layers.diffuse",
    "layers.lightmap",
    "shells",
    "layers.local",
    "layers.hull_split",
    "maps.distant",
    "maps.shared_distant",
    "maps.size",
    "trace.noise",
    "views.traced",
    "views.around",
    "infer.passes",
    "infer.neighbours",
    "static.views",
)
"""Keys of a scene file of which every plan has decisions, in the order in which they are decided. Shells
before the last have decisions on `shells.proxy`, too; on `infer.smoothness`, `views.count` and `views.rings`
there are decisions only where these are "auto"."""


USUAL_WEIGHT = 1e-4
"""λ for which the regulariser's other weights are meant where a plan decides it."""

DecisionValue: TypeAlias = bool | int | float | str | list[dict[str, Any]]
"""Of a key of a scene file; the list of tables of `shells`."""


def with_weight(infer: Infer, weight: float) -> Infer:
    """Return settings with a λ of smoothness in place of "auto", and the other weights scaled alike."""
    scale = weight / USUAL_WEIGHT
    return infer.model_copy(
        update={
            "smoothness": weight,
            "level_agreement": scale * infer.level_agreement,
            "prior_weight": scale * infer.prior_weight,
        }
    )


@dataclass(frozen=True)
class Decision:
    """The value of one key, and why."""

    key: str
    """Of the scene file: one of `DECIDED_KEYS`, or `shells.proxy`, the geometry of a shell."""
    part: str | None
    """The part of the reflector that it is about; None: all."""
    value: DecisionValue
    automatic: bool
    """False: the scene file sets the value."""
    reason: str
    """With the number that was measured, for people."""
    measured: float | None
    """That number alone, in the unit of the reason (a share for per cent); None: nothing was measured."""
    shell: str | None = None
    """The shell whose maps it is about; None: all."""

    def __str__(self) -> str:
        """Return the line of a scene file that sets the value, with the reason as its comment.

        >>> str(Decision("maps.size", None, 256, False, "set in the scene", None))
        'maps.size = 256  # set in the scene'
        >>> str(Decision("layers.local", "lid", True, True, "it reflects itself", 0.1))
        'layers.local = true  # lid: it reflects itself'
        >>> str(Decision("maps.size", "lid", 64, True, "it is strongly curved", 0.1, "local"))
        'maps.size = 64  # lid/local: it is strongly curved'
        >>> str(Decision("shells", None, [{"name": "all"}], True, "it sees the sky alone", None))
        'shells = [{ name = "all" }]  # it sees the sky alone'
        """
        about = "/".join(name for name in (self.part, self.shell) if name is not None)
        return f"{self.key} = {_toml(self.value)}  # {about}{': ' if about else ''}{self.reason}"


def _toml(value: DecisionValue) -> str:
    # Booleans, numbers, plain strings and lists of these are the same in JSON and TOML.
    if not isinstance(value, list):
        return json.dumps(value)
    tables = (", ".join(f"{key} = {json.dumps(entry)}" for key, entry in table.items()) for table in value)
    return "[" + ", ".join(f"{{ {table} }}" for table in tables) + "]"


@dataclass(frozen=True)
class PlannedShell:
    """A shell of a bake."""

    name: str
    proxies: dict[str, dict[str, Any]]
    """Its geometry for each part of the reflector that has a map of it, as in a PEM's attributes."""


@dataclass(frozen=True)
class Plan:
    """All decisions of a bake, and the geometry that they lead to."""

    decisions: tuple[Decision, ...]
    distant: dict[str, Any]
    """Proxy of the distant layer, the last shell, as in a PEM's attributes."""
    shells: tuple[PlannedShell, ...] = ()
    """Front to back."""
    advice: tuple[str, ...] = ()
    """What was measured of choices that are the user's: whether a PEM is worth it, and what would do."""
    law: SpacingLaw | None = None
    """Measured where the plan decides how far apart the maps are."""

    def value(self, key: str, part: str | None = None, shell: str | None = None) -> DecisionValue:
        """Return what was decided; KeyError for what was not."""
        for decision in self.decisions:
            if decision.key == key and decision.part in (None, part) and decision.shell in (None, shell):
                return decision.value
        raise KeyError(key)

    @property
    def depth(self) -> int:
        """Specular bounces after the first."""
        return cast("int", self.value("trace.depth"))

    @property
    def samples(self) -> int:
        """Rays per pixel."""
        return cast("int", self.value("trace.samples"))

    @property
    def map_size(self) -> int:
        """Texels along a side of a face of the largest map."""
        return max(cast("int", decision.value) for decision in self.decisions if decision.key == "maps.size")

    def size_of(self, part: str, shell: str) -> int:
        """Texels along a side of a face of a map."""
        return cast("int", self.value("maps.size", part, shell))

    @property
    def has_diffuse(self) -> bool:
        """Whether there is a diffuse layer."""
        return bool(self.value("layers.diffuse"))

    @property
    def lightmap(self) -> int:
        """Texels along a side of the map of the diffuse layer's irradiance; 0: it is at the vertices."""
        decided = (decision.value for decision in self.decisions if decision.key == "layers.lightmap")
        return cast("int", next(decided, 0)) if self.has_diffuse else 0

    def has_local(self, part: str) -> bool:
        """Whether a part of the reflector gets a map of what the object reflects of itself."""
        return bool(self.value("layers.local", part))

    def lines(self) -> list[str]:
        """Return the decisions in words, one a line, and the law of spacing and the advice as comments."""
        comments = [*([] if self.law is None else [str(self.law)]), *self.advice]
        return [*(str(decision) for decision in self.decisions), *(f"# {words}" for words in comments)]

    @property
    def has_hull_split(self) -> bool:
        """Whether local maps leave out the polygons on the convex hull."""
        return bool(self.value("layers.hull_split"))

    @property
    def shell_sections(self) -> Shells:
        """The sections [[shells]]."""
        tables = cast("list[dict[str, Any]]", self.value("shells"))
        return tuple(ShellSection.model_validate(table) for table in tables)

    def resolve(self, config: SceneConfig) -> SceneConfig:
        """Return the scene with what the tracing of its views needs in place of "auto"."""

        def resolved(section: str, *names: str) -> Any:
            values = {name: self.value(f"{section}.{name}") for name in names}
            return getattr(config, section).model_copy(update=values)

        infer = resolved("infer", "passes", "neighbours")
        weight = next((d.value for d in self.decisions if d.key == "infer.smoothness"), None)
        if infer.smoothness is None and weight is not None:
            infer = with_weight(infer, cast("float", weight))
        views = resolved("views", "traced", "around")
        config = self.shaped(config)
        spaced = {d.key: d.value for d in self.decisions if d.key in ("views.count", "views.rings")}
        if spaced:
            views = views.model_copy(update={key.split(".")[1]: value for key, value in spaced.items()})
        return config.model_copy(
            update={
                "maps": resolved("maps", "shared_distant"),
                "trace": resolved("trace", "samples", "noise", "depth"),
                "views": views,
                "infer": infer,
                "static": resolved("static", "views"),
                "shells": self.shell_sections,
            }
        )

    def shaped(self, config: SceneConfig) -> SceneConfig:
        """Return the scene with the reflector's mesh, and its parts, as the plan has them."""
        edge = next((d.value for d in self.decisions if d.key == "reflector.longest_edge"), 0.0)
        shape = {"longest_edge": edge, "parts": self.value("reflector.parts")}
        reflector = config.reflector.model_copy(update=shape)
        return config.model_copy(update={"reflector": reflector})

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "decisions": [asdict(decision) for decision in self.decisions],
            "distant": self.distant,
            "shells": [asdict(shell) for shell in self.shells],
            "advice": list(self.advice),
            **({} if self.law is None else {"law": self.law.to_dict()}),
        }

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> Plan:
        """Inverse of `to_dict`. Raises KeyError or TypeError for what is not one."""
        plan = Plan(
            tuple(Decision(**decision) for decision in data["decisions"]),
            data["distant"],
            tuple(PlannedShell(**shell) for shell in data["shells"]),
            tuple(data["advice"]),
            SpacingLaw.from_dict(data["law"]) if "law" in data else None,
        )
        # Without decisions on them the mesh is as its file has it, and the body's light at its vertices.
        for key in set(DECIDED_KEYS) - {"reflector.longest_edge", "layers.lightmap"}:
            if all(decision.key != key for decision in plan.decisions):
                raise KeyError(key)
        size: Any = plan.lightmap
        if type(size) is not int or not 0 <= size <= MAX_MAP_SIZE or size & (size - 1):
            raise KeyError("layers.lightmap")
        return plan
