"""The report of a PEM: one HTML file."""

from mirrorbake.evaluate.report.page import REPORT_NAME, report

__all__ = ["REPORT_NAME", "report"]
