"""What a diagnosis found, for people: one HTML page to mail, and the same charts as PNG files."""

from taichidem.study.report.page import write_report
from taichidem.study.report.pictures import write_look_alikes, write_standardised_errors, write_waterfall

__all__ = ["write_look_alikes", "write_report", "write_standardised_errors", "write_waterfall"]
