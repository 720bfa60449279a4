"""How well a PEM does, in figures and pictures."""

from mirrorbake.evaluate.contact_sheet import contact_sheet
from mirrorbake.evaluate.contenders import CONTENDERS, TITLES, render_contenders
from mirrorbake.evaluate.evaluate import Evaluation, ViewMetrics, evaluate
from mirrorbake.evaluate.metrics import display_referred, psnr

__all__ = [
    "CONTENDERS",
    "TITLES",
    "Evaluation",
    "ViewMetrics",
    "contact_sheet",
    "display_referred",
    "evaluate",
    "psnr",
    "render_contenders",
]
