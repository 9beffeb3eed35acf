"""`report.html` of a comparison: who tracked how well, and who bears what."""

NAME = "report.html"
"""Of the page's file; known without what draws it."""
