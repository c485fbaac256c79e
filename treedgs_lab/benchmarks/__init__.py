"""What judges the rest on plots with truth, and the experiments behind the docs; the index is README.md."""
