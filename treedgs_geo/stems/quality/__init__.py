"""The measured tree: its record, its reasons and flags, and the limits behind them, shared by every route."""
