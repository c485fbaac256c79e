"""The plugin's shell: provider, parameters, and running the engine as a child process.

Only the standard library and ``qgis`` are imported here; everything that computes runs in the engine
(``python -m treedgs_geo``) with its own Python environment.
"""
