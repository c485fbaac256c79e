"""The layers' styles, one module a family; written by ``tools/write_styles.py``."""
