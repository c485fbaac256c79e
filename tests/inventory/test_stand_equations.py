"""Equations as data: published values, ranges, the user's own table, and formulas that must not be run."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.settings import params_of
from treedgs_geo.inventory.stand.equations import COLUMNS, ORIGINS, QUANTITIES, Formula, choose, read_equations
from treedgs_geo.inventory.stand.species import species_of
from treedgs_geo.inventory.stand.values import fit_curve

HEAD = "id,quantity,species,origin,formula,dbh_unit,height_unit,result_unit,dbh_min,dbh_max,limits,source\n"


def value(quantity, species, dbh_cm, height_m=np.nan, origin="natural"):
    equation = choose(read_equations(), quantity, species_of(species), origin, np.isfinite(height_m))
    return equation.id, float(equation.value(np.array([dbh_cm]), np.array([height_m]))[0])


@pytest.mark.parametrize(
    ("quantity", "species", "origin", "dbh_cm", "height_m", "expected", "equation"),
    [
        # NSVB (GTR WO-104), planted loblolly: 50, 224 and 600 kg worked out by hand from table S8a.
        ("biomass", "PITA", "planted", 15, 12, 50.2, "nsvb-agb-pita-planted"),
        ("biomass", "131", "planted", 25, 20, 224.1, "nsvb-agb-pita-planted"),
        ("biomass", "Pinus taeda", "planted", 35, 25, 599.7, "nsvb-agb-pita-planted"),
        # The authors' own program (nsvb 0.3.0) gives 500 lb for a natural one.
        ("biomass", "loblolly pine", "natural", 25, 20, 500 * 0.45359237, "nsvb-agb-pita-natural"),
        # Jenkins et al. 2003: exp(-2.5356 + 2.4349 ln 25) = 200.7 kg, for want of a height.
        ("biomass", "PITA", "natural", 25, np.nan, 200.7, "jenkins-agb-pine"),
        # A pine without a row of its own takes its group's.
        ("volume", "PIPU5", "natural", 30, 20, None, "nsvb-vob-pine"),
        # Laasasenaho 1982: 274 dm3 for a Scots pine of 20 cm and 18 m.
        ("volume", "PISY", "natural", 20, 18, 0.2737, "laasasenaho-pisy"),
        ("volume", None, "natural", 30, 20, 0.45 * np.pi / 4 * 0.09 * 20, "form-factor-0.45"),
        # FVS Southern variant: 4.5 + 243.86 exp(-4.2846 * 9.8425^-0.4713) = 61.2 ft
        ("height", "PITA", "natural", 25, np.nan, 18.66, "fvs-sn-height-pita"),
    ],
)
def test_published_values(quantity, species, origin, dbh_cm, height_m, expected, equation):
    name, found = value(quantity, species, dbh_cm, height_m, origin)
    assert name == equation
    if expected is not None:
        assert found == pytest.approx(expected, rel=1e-3)


def test_nsvb_volume_in_inches_and_feet():
    """0.00186491 * 10^2.137300891 * 70^1.007045365 cubic feet."""
    by_hand = 0.00186491 * 10**2.137300891 * 70**1.007045365 * 0.3048**3
    assert value("volume", "PITA", 25.4, 70 * 0.3048, "planted")[1] == pytest.approx(by_hand, rel=1e-9)


def test_the_segmented_equation_is_continuous():
    below, above = (value("biomass", "PITA", 9 * 2.54 + d, 18.0, "planted")[1] for d in (-1e-6, 1e-6))
    assert above == pytest.approx(below, rel=1e-5)


def test_every_built_in_equation_is_sound():
    """Cites its source, grows with DBH and height, and gives a tree-like form factor or density inside its range."""
    book = read_equations()
    assert {equation.quantity for equation in book} == set(QUANTITIES)
    for equation in book:
        assert len(equation.source) > 30 and equation.limits, equation.id
        unit = 2.54 if equation.dbh_unit == "in" else 1.0
        d = np.linspace(max(equation.dbh_min * unit, 8), min(equation.dbh_max * unit, 60), 30)
        h = np.full(30, 20.0)
        found = equation.value(d, h)
        assert np.isfinite(found).all() and (np.diff(found) > 0).all(), equation.id
        if equation.quantity == "volume":
            factor = found / (np.pi / 4 * (d / 100) ** 2 * h)
            assert (factor[d > 15] > 0.3).all() and (factor[d > 15] < 0.65).all(), (equation.id, factor)
        elif equation.quantity == "height":
            assert ((found > 3) & (found < 50)).all(), equation.id
        else:
            at25 = float(equation.value(np.array([25.0]), np.array([20.0]))[0])
            assert 100 < at25 < 500, (equation.id, at25)
        assert not equation.outside(d[1:-1], h[1:-1]).any()
        assert equation.outside(np.array([0.5, 300.0]), np.array([20.0, 20.0])).all(), equation.id


def test_unknown_species_have_no_biomass_by_guess():
    for species in (None, "Quercus nonesuch", "41x"):
        assert choose(read_equations(), "biomass", species_of(species), "natural", True) is None


def test_the_users_own_rows_come_first(tmp_path):
    own = tmp_path / "own.csv"
    own.write_text(HEAD + 'mine,volume,"PITA 121",any,1e-4*D**2*H,cm,m,m3,10,50,me,"Smith 1999, table 2"\n')
    book = read_equations(own)
    assert choose(book, "volume", species_of("PITA"), "natural", True).id == "mine"
    assert choose(book, "volume", species_of("longleaf pine"), "natural", True).id == "mine"
    assert choose(book, "volume", species_of("PIEC2"), "natural", True).id == "nsvb-vob-piec2"
    assert set(COLUMNS) >= set(HEAD.strip().split(","))


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("a,volume,*,any,D*x,cm,m,m3,,,me,book", "'x' is not allowed"),
        ("a,volume,*,any,D**,cm,m,m3,,,me,book", "is no formula"),
        ("a,volume,*,any,D,cm,m,gallons,,,me,book", "result_unit 'gallons'"),
        ("a,volume,*,any,D,inch,m,m3,,,me,book", "dbh_unit 'inch'"),
        ("a,weight,*,any,D,cm,m,kg,,,me,book", "quantity 'weight'"),
        ("a,volume,*,wild,D,cm,m,m3,,,me,book", "origin 'wild'"),
        ("a,volume,*,any,D,cm,m,m3,ten,,me,book", "dbh_min is 'ten'"),
        ("a,volume,*,any,D,cm,m,m3,,,me,", "no source"),
        ("a,height,*,any,D*H,cm,m,m,,,me,book", "needs H itself"),
        ("a,volume,*,any,D,cm,m,m3,,,me,book\na,volume,*,any,D,cm,m,m3,,,me,book", "line 3: id 'a'"),
    ],
)
def test_mistakes_are_named_with_their_line(tmp_path, row, message):
    own = tmp_path / "own.csv"
    own.write_text(HEAD + row + "\n")
    with pytest.raises(InputError, match=message):
        read_equations(own)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "D.__class__",
        "(lambda: 1)()",
        "[D for D in (1,)]",
        "open('x')",
        "exp",
        "exp(D, H)",
        "exp(D, x=1)",
        "where(D < 1 < 2, 1, 2)",
        "D if H else 1",
        "D @ H",
        "D // H",
        "D and H",
        "'a'",
        "1j*D",
        "True",
        "D[0]",
        "f'{D}'",
        "(D := 3)",
        "*D",
        "1e999*D",
        "-" * 200 + "D",
        "(" * 300 + "D" + ")" * 300,
        "D+" * 400 + "D",
        "9" * 400,
        "",
    ],
)
def test_what_is_no_formula_is_refused(text):
    with pytest.raises(InputError):
        Formula(text)


def test_a_formula_cannot_hang_or_break():
    assert not np.isfinite(Formula("9**9**9**9*D")(D=2.0, H=1.0))
    assert np.isnan(Formula("ln(0-D)")(D=2.0, H=1.0)) and np.isinf(Formula("1/(D-D)")(D=2.0, H=1.0))


@given(st.floats(0.1, 300), st.floats(1.3, 90))
def test_formulas_mean_what_they_say(d, h):
    found = Formula("where(D < 20, max(D, 3)**1.5, sqrt(D)*ln(H + 1)) - min(D, H)/log10(D + 10) + pi*-2")(D=d, H=h)
    first = max(d, 3) ** 1.5 if d < 20 else np.sqrt(d) * np.log(h + 1)
    assert found == pytest.approx(first - min(d, h) / np.log10(d + 10) - 2 * np.pi, rel=1e-12)


def test_species_by_any_name():
    assert {species_of(n).symbol for n in ("PITA", "pita", "131", "131.0", "Pinus taeda", " loblolly  pine")} == {
        "PITA"
    }
    assert species_of("XYZ").symbol == "XYZ" and species_of(None).symbol == species_of("nan").symbol == "unknown"
    assert all(origin in ("natural", "planted") for origin in ORIGINS)


def test_the_height_curve_finds_what_made_the_heights():
    rng = np.random.default_rng(2)
    d = rng.uniform(10, 45, 40)
    true = 1.37 + (d / (1.5 + 0.19 * d)) ** 2
    curve, why = fit_curve(d, true + rng.normal(0, 0.5, 40))
    assert why == "" and np.abs(curve(d) - true).max() < 0.6 and curve.rmse_m == pytest.approx(0.5, rel=0.35)
    # One height typed in feet does not carry the curve away.
    bad = true.copy()
    bad[3] *= 3.28
    assert np.abs(fit_curve(d, bad)[0](d) - true).max() < 0.6
    assert curve.outside(np.array([5.0, 20.0])).tolist() == [True, False]


@pytest.mark.parametrize(
    ("d", "h", "message"),
    [
        (np.arange(10, 19), np.full(9, 15.0), "needs 10"),
        (np.full(20, 25.0), np.full(20, 18.0), "too narrow"),
        (np.arange(10, 30), np.full(20, np.nan), "0 trees"),
    ],
)
def test_no_curve_from_too_little(d, h, message):
    curve, why = fit_curve(d, h)
    assert curve is None and message in why


def test_the_page_names_what_there_is():
    from pathlib import Path

    from treedgs_geo.inventory.stand.expansion import MISSING
    from treedgs_geo.verbs.stand_table import FILES, StandTableSettings

    page = (Path(__file__).parents[2] / "docs" / "technician" / "stand-table.md").read_text(encoding="utf-8")
    shapefile_parts = (".shx", ".dbf", ".prj", ".cpg")
    assert [name for name in FILES if f"`{name}`" not in page and not name.endswith(shapefile_parts)] == []
    choices = {name: spec.choices for name, spec, _ in params_of(StandTableSettings)}
    assert [rule for rule in choices["edge"] if f"| `{rule}`" not in page] == []
    assert [mode for mode in (*choices["heights"], *MISSING) if mode not in page] == []
    families = {equation.id.rsplit("-", 1)[0].split("-")[0] for equation in read_equations()}
    assert [name for name in families if f"`{name}-" not in page] == []
