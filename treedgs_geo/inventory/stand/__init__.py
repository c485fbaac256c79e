"""Stand tables: plots, expansion, equations kept as data, estimates with their errors, and the report's files."""
