"""A stem that the photos show clearly: what the verdict is given, to be changed one quantity at a time."""

CLEAR = {
    "dbh_cm": 30,
    "polish_cm": 30.5,
    "r1": -0.005,
    "lean_deg": 1.1,
    "llr": 120,
    "gap": 60,
    "n_views": 12,
    "kish": 10,
    "se_cm": 0.5,
    "rms_px": 0.48,
}
