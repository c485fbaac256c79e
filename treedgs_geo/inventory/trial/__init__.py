"""A trial on taped trees: results and limit sealed before the tapes are known, judged after."""
