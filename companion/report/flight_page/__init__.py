"""`report.html` of a flight: did it track, and if not why; its figures, phases and messages."""

NAME = "report.html"
"""Of the page's file; known without what draws it."""
