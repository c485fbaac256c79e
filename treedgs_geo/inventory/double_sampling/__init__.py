"""Double sampling: trees measured everywhere, a few of them taped; which, and what the tapes say of the totals."""
