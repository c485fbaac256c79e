"""Names of columns in English, German, Spanish, French, Polish, Finnish and FIA's tables; their units and bounds."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

_CM = {"cm": 1.0, "mm": 0.1, "m": 100.0, "in": 2.54}
_M = {"m": 1.0, "ft": 0.3048}
_DEG = {"deg": 1.0, "gon": 0.9, "mil": 360 / 6400}
_AREA = {"m2": 1.0, "ha": 1e4, "ac": 4046.8564224}
#: Other names of units.
_UNITS = {
    "in": "inch inches zoll pulgadas pouces",
    "ft": "feet foot fuss pies",
    "m": "metres meters metros meter",
    "m2": "m² sqm",
    "ac": "acre acres",
    "deg": "degrees grad grados °",
    "gon": "gons gr grades",
    "mil": "mils",
    "pct": "percent prozent %",
}


@dataclass(frozen=True)
class Quantity:
    """what: in a sentence. names: that a column may have, the best first, without the unit. units: those that a name
    may say -> how many of the first one. low, high: bounds, in the first unit."""

    what: str
    names: str
    units: Mapping[str, float] = field(default_factory=dict)
    low: float = -np.inf
    high: float = np.inf

    @property
    def unit(self) -> str:
        """The first unit, which values are given in."""
        return next(iter(self.units), "")

    @property
    def examples(self) -> str:
        """``distance_m or distance_ft``."""
        first = self.names.split()[0]
        return " or ".join(f"{first}_{unit}" for unit in self.units) or first


_DBH = "dbh bhd dap dhp d13 d130 d_1_3 d1_3 d_130 diameter durchmesser diametro diametre piersnica laepimitta diam d"
_GIRTH = "girth circumference gbh cbh umfang cap circunferencia circonference obwod ympaerysmitta"
_HEIGHT = "height ht tree_height total_height hoehe baumhoehe altura altura_total hauteur wysokosc pituus h"


def _reading(k: int) -> Quantity:
    """The first or second of two readings of a DBH, as callipers are read crosswise."""
    return Quantity("a DBH", " ".join(f"{name}{k} {name}_{k}" for name in _DBH.split()), _CM, 0.5, 500.0)


#: Every column that a table of plots or trees may have.
QUANTITIES = {
    "plot_id": Quantity(
        "the plot",
        "plot_id plot plotid plot_no plot_nr plot_number plot_name probekreis probekreis_nr probeflaeche parcela "
        "parcela_id id_parcela parcela_no placette nr_powierzchni koeala koealan_nro subplot subp",
    ),
    "field_id": Quantity(
        "the tree's number",
        "tree_id field_id tree treeid tree_no tree_nr tree_number stem_id tag baum_id baum baumnr baum_nr baumnummer "
        "arbol_id id_arbol arbol arbol_no numero_de_arbol arbre n_arbre n°_arbre no_arbre num_arbre nr_drzewa drzewo "
        "puu puu_nro puun_nro nr no num numero n",
    ),
    "azimuth": Quantity("the bearing", "azimuth bearing az azim azimut peilung rumbo acimut azymut suunta", _DEG),
    "distance": Quantity("the distance", "distance dist entfernung distanz abstand distancia odleglosc etaeisyys", _M),
    "easting": Quantity(
        "the easting",
        "easting x x_m east e este ostwert rechtswert utm_x utm_e x_utm x_coord coord_x coordenada_x x_easting",
    ),
    "northing": Quantity(
        "the northing",
        "northing y y_m north n norte nordwert hochwert utm_y utm_n y_utm y_coord coord_y coordenada_y y_northing",
    ),
    "lon": Quantity(
        "the longitude", "lon long longitude lng lon_deg longitude_deg gpslongitude laengengrad longitud x_longitude"
    ),
    "lat": Quantity("the latitude", "lat latitude lat_deg latitude_deg gpslatitude breitengrad latitud y_latitude"),
    "epsg": Quantity("the EPSG code", "epsg srid crs epsg_code"),
    "radius": Quantity("the radius", "radius plot_radius halbmesser radio rayon promien saede r", _M, 0.1, 1000.0),
    "width": Quantity("the width", "width breite ancho", _M, 0.1, 1000.0),
    "length": Quantity("the length", "length laenge largo", _M, 0.1, 1000.0),
    "area": Quantity("the area", "area plot_area flaeche superficie", _AREA),
    "dbh": Quantity("the DBH", _DBH, _CM, 0.5, 500.0),
    "dbh1": _reading(1),
    "dbh2": _reading(2),
    "girth": Quantity("the girth", _GIRTH, _CM, 1.5, 1600.0),
    "height": Quantity("the height", _HEIGHT, _M),
    "slope": Quantity("the slope", "slope neigung hangneigung pendiente pente", {"deg": 1.0, "pct": 1.0}),
    "aspect": Quantity("where the slope faces", "aspect exposition orientacion", _DEG),
    "status": Quantity("live or dead", "status tree_status zustand estado etat"),
    "condition": Quantity(
        "the condition",
        "condition tree_condition health tree_health vitality live_dead dead_live alive_dead gesundheit vitalitaet "
        "lebend_tot condicion sanidad vitalidad vivo_muerto",
    ),
    "dead": Quantity(
        "whether it is dead",
        "dead is_dead isdead dead_tree snag standing_dead tot abgestorben totholz stehend_tot duerr muerto "
        "muerta muerto_en_pie seco mort martwe kuollut",
    ),
    "alive": Quantity("whether it lives", "alive live living is_alive is_live isalive lebend lebendig lebt vivo viva"),
    "count": Quantity(
        "how many trees",
        "count tree_count stem_count n_trees n_stems no_trees no_stems no_of_trees no_of_stems number_of_trees "
        "number_of_stems num_trees num_stems total_trees trees stems frequency freq tally qty quantity "
        "anzahl anzahl_baeume anzahl_staemme baumzahl stammzahl stueckzahl stueck stk haeufigkeit "
        "n_arboles n_pies num_arboles no_arboles no_de_arboles numero_arboles numero_de_arboles numero_pies "
        "numero_de_pies arboles pies conteo cantidad cantidad_arboles cantidad_de_arboles frecuencia",
    ),
    "expansion": Quantity(
        "trees per area",
        "tpa_unadj tpa tph trees_per_acre trees_per_ha stems_per_acre stems_per_ha expansion expansion_factor "
        "exp_factor n_ha n_per_ha stems_ha trees_ha baeume_ha baeume_pro_ha staemme_ha arboles_ha pies_ha nha expf "
        "tree_factor repraesentationszahl",
    ),
    "species": Quantity("the species", "species spp sp species_code baumart art especie essence gatunek puulaji"),
    "date": Quantity("the date", "date field_date survey_date date_measured datum fecha"),
}
#: Those of a table of photos or control points.
QUANTITIES |= {
    "photo": Quantity("the photo", "photo image image_name imagename filename file sourcefile name label"),
    "altitude": Quantity(
        "the height", "h height height_m alt altitude ellh z elevation ellipsoidal_height gpsaltitude z_altitude"
    ),
    "sd_e": Quantity("its error", "sd_e sde sde_m std_e sd_h_m acch h_acc accuracy_x", {"m": 1.0}, 1e-4, 100.0),
    "sd_n": Quantity("its error", "sd_n sdn sdn_m std_n sd_h_m acch h_acc accuracy_y", {"m": 1.0}, 1e-4, 100.0),
    "sd_u": Quantity("its error", "sd_u sdu sdu_m std_u sd_v_m accv v_acc accuracy_z", {"m": 1.0}, 1e-4, 100.0),
    "point": Quantity("the point", "label gcp gcp_name point point_id marker id name"),
    "u": Quantity("the pixel's column", "u u_px px pixel_x im_x"),
    "v": Quantity("the pixel's row", "v v_px py pixel_y im_y"),
    "kind": Quantity("control or check", "kind type role"),
    "bar": Quantity("the scale bar", "bar scale_bar scalebar massstab barra"),
}
#: FIA's TREE table (https://www.fia.fs.usda.gov): degrees, feet and inches by definition. Columns that tell it.
FIA = {
    "plot_id": ("subp", ""),
    "field_id": ("tree", ""),
    "azimuth": ("azimuth", "deg"),
    "distance": ("dist", "ft"),
    "dbh": ("dia", "in"),
    "height": ("ht", "ft"),
    "species": ("spcd", ""),
    "status": ("statuscd", ""),
}
FIA_MARKS = {"spcd", "statuscd", "tpa_unadj", "plt_cn"}


@cache
def spellings(key: str) -> list[tuple[str, str]]:
    """Names (:func:`plain_name`) of a quantity's column with the unit that each says, the best first."""
    units = QUANTITIES[key].units
    found = []
    for name in QUANTITIES[key].names.split():
        for unit in units:
            for spelt in (unit, *_UNITS.get(unit, "").split()):
                found.append((plain_name(f"{name}_{spelt}"), unit))
                if len(name) > 2:
                    found.append((plain_name(name + spelt), unit))
        found.append((name, ""))
    return found


def plain_name(name: str) -> str:
    """Without accents; umlauts as Germans write them where there are none: ``höhe`` is ``hoehe``."""
    for letter, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss"), ("ł", "l")):
        name = name.replace(letter, letters)
    return "".join(letter for letter in unicodedata.normalize("NFKD", name) if not unicodedata.combining(letter))
