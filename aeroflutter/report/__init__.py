"""A report to click through: every analysis of a case on one page that needs no network."""

from aeroflutter.report.analyses import Analyses, ReportOptions, analyse
from aeroflutter.report.content import gather
from aeroflutter.report.page import plotly_source, render

__all__ = ["Analyses", "ReportOptions", "analyse", "gather", "plotly_source", "render"]
