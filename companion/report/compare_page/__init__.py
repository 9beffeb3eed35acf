"""`report.html` of a comparison: who tracked how well, and who bears what."""
