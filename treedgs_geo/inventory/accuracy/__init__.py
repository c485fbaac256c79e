"""Accuracy of measured trees against field trees or truth: scores, tables, charts, the page."""
