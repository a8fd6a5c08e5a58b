"""Reports: one self-contained HTML page a result. The only importer of matplotlib.

The package is also the verb of its name, ``tarsus.report(folder)``.
"""

from tarsus.base.verb import callable_package
from tarsus.report.run_page import write_report

__all__ = ["write_report"]

callable_package(__name__, "tarsus.report.verb:report")
