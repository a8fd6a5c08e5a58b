"""Reports: one self-contained HTML page per run or validation. The only importer of matplotlib."""

from tarsus.report.millipede_page import write_millipede_report
from tarsus.report.robot_page import write_robot_report
from tarsus.report.run_page import write_report
from tarsus.report.validation_page import write_validation_report

__all__ = ["write_millipede_report", "write_report", "write_robot_report", "write_validation_report"]
