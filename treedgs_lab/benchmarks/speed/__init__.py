"""Speed against accuracy, and what work costs."""
