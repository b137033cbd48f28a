"""Pages to look at: each one file that needs no network, for any browser with WebGL."""

from .report import report_page
from .view import view_page

__all__ = ["report_page", "view_page"]
