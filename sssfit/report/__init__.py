"""One HTML page about a material: its kernels running in the page, charts, tables and exports.

`record` gathers what the page shows, `html` writes it, and `library` writes an index of materials.
The page needs no network and no server.
"""

from sssfit.report.html import is_report_file, page
from sssfit.report.library import library_page
from sssfit.report.record import Report, make_report

__all__ = ["Report", "is_report_file", "library_page", "make_report", "page"]
