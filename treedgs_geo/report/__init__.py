"""What every page is made of: blocks, written as HTML, PDF, Markdown or LaTeX, and one style of charts."""
