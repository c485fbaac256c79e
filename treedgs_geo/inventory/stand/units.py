"""Metric and US units, and DBH classes in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ACRE_HA = 0.40468564224
FOOT = 0.3048
POUND = 0.45359237


@dataclass(frozen=True)
class Quantity:
    """heading and unit as shown; key: column name with its unit; factor: from metric; decimals."""

    key: str
    label: str
    unit: str
    factor: float
    decimals: int

    @property
    def heading(self) -> str:
        """Label and unit."""
        return f"{self.label}, {self.unit}" if self.unit else self.label


METRIC = {
    "trees": Quantity("trees_ha", "Trees", "per ha", 1.0, 1),
    "ba": Quantity("ba_m2_ha", "Basal area", "m²/ha", 1.0, 2),
    "volume": Quantity("volume_m3_ha", "Volume", "m³/ha", 1.0, 1),
    "biomass": Quantity("biomass_t_ha", "Biomass", "t/ha", 1.0, 1),
    "qmd": Quantity("qmd_cm", "Quadratic mean diameter", "cm", 1.0, 2),
    "lorey": Quantity("lorey_m", "Lorey's mean height", "m", 1.0, 2),
    "dominant": Quantity("dominant_m", "Dominant height", "m", 1.0, 2),
    "dbh": Quantity("dbh_cm", "DBH", "cm", 1.0, 1),
    "height": Quantity("height_m", "Height", "m", 1.0, 1),
    "area": Quantity("area_ha", "Area", "ha", 1.0, 4),
}
_US = {
    "trees": Quantity("trees_ac", "Trees", "per ac", ACRE_HA, 1),
    "ba": Quantity("ba_ft2_ac", "Basal area", "ft²/ac", ACRE_HA / FOOT**2, 2),
    "volume": Quantity("volume_ft3_ac", "Volume", "ft³/ac", ACRE_HA / FOOT**3, 0),
    "biomass": Quantity("biomass_tn_ac", "Biomass", "short tons/ac", ACRE_HA * 1000 / (2000 * POUND), 1),
    "qmd": Quantity("qmd_in", "Quadratic mean diameter", "in", 1 / 2.54, 2),
    "lorey": Quantity("lorey_ft", "Lorey's mean height", "ft", 1 / FOOT, 1),
    "dominant": Quantity("dominant_ft", "Dominant height", "ft", 1 / FOOT, 1),
    "dbh": Quantity("dbh_in", "DBH", "in", 1 / 2.54, 1),
    "height": Quantity("height_ft", "Height", "ft", 1 / FOOT, 1),
    "area": Quantity("area_ac", "Area", "ac", 1 / ACRE_HA, 4),
}
UNITS = {"metric": METRIC, "us": _US}
#: Usual class widths, cm and inches.
CLASS_WIDTH = {"metric": 5.0, "us": 2.0}


@dataclass(frozen=True)
class Classes:
    """DBH classes of one width. lower: limits in the shown unit; inches are centred on whole multiples, as is usual."""

    width: float
    unit: str
    centred: bool

    def of(self, dbh_cm: np.ndarray) -> np.ndarray:
        """Class number of each DBH; a DBH on a limit belongs to the class above it."""
        size = np.asarray(dbh_cm, float) / (2.54 if self.unit == "in" else 1.0) / self.width
        # A hair of tolerance: 15.24 cm are 6 inches, whatever the last bit says.
        return np.floor(size + (0.5 if self.centred else 0.0) + 1e-9).astype(int)

    def lower(self, number: int) -> float:
        """Lower limit of a class."""
        return max((number - (0.5 if self.centred else 0.0)) * self.width, 0.0)

    def upper(self, number: int) -> float:
        """Upper limit of a class (not in it)."""
        return (number + (0.5 if self.centred else 1.0)) * self.width

    def label(self, number: int) -> str:
        """``25–30`` (cm) or ``10`` (the inch class)."""
        if self.centred:
            return f"{number * self.width:g}"
        return f"{self.lower(number):g}–{self.upper(number):g}"


def make_classes(units: str, width: float | None) -> Classes:
    """Classes of the usual width, or the user's (cm in metric, inches in US units)."""
    return Classes(width or CLASS_WIDTH[units], "in" if units == "us" else "cm", units == "us")
