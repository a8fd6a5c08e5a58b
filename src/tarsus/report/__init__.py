"""Reports: one self-contained HTML page a run. The only importer of matplotlib."""

from tarsus.report.run_page import write_report

__all__ = ["write_report"]
