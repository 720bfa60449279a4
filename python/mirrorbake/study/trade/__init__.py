"""The trade of time and bytes against error, on the user's own scene."""

from mirrorbake.study.trade.axes import AXIS_NAMES, Axis, Setting
from mirrorbake.study.trade.study import STUDY_NAME, Study, advice, study
from mirrorbake.study.trade.trial import Trial

__all__ = ["AXIS_NAMES", "STUDY_NAME", "Axis", "Setting", "Study", "Trial", "advice", "study"]
