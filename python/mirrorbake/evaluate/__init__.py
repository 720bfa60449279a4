"""How well a PEM does, in figures and pictures."""

from mirrorbake.evaluate.contact_sheet import contact_sheet
from mirrorbake.evaluate.contenders import CONTENDERS, RUN_TIMES, TITLES, Contender, contenders_of
from mirrorbake.evaluate.evaluate import Evaluation, ViewFigures, evaluate
from mirrorbake.evaluate.metrics import display_referred, flip, psnr, sliding, ssim
from mirrorbake.evaluate.places import PLACES
from mirrorbake.evaluate.references import Reference, trace_reference

__all__ = [
    "CONTENDERS",
    "PLACES",
    "RUN_TIMES",
    "TITLES",
    "Contender",
    "Evaluation",
    "Reference",
    "ViewFigures",
    "contact_sheet",
    "contenders_of",
    "display_referred",
    "evaluate",
    "flip",
    "psnr",
    "sliding",
    "ssim",
    "trace_reference",
]
