"""One HTML page about a material: its kernels running in the page, charts, tables and exports.

`make` computes what the page shows, a `record`; `html` writes it, and `library` writes an index of
materials.
The page needs no network and no server.
"""

from sssfit.report.finished import finished_page
from sssfit.report.html import is_report_file, page
from sssfit.report.library import library_page
from sssfit.report.make import make_report
from sssfit.report.record import Report

__all__ = ["Report", "finished_page", "is_report_file", "library_page", "make_report", "page"]
