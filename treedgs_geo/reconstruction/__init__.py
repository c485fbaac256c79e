"""Photos with positions -> georeferenced cameras, sparse points and a dense prior."""
