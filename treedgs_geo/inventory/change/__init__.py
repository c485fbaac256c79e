"""Two tree layers of the same ground at two dates: which tree is which, and what grew, came and went."""
