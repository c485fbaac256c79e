"""The stability suite: one trouble at a time, from harmless to hopeless."""
