"""Simulator, benchmarks, the publication's tables: what makes worlds and judges. The library does not import it."""
