"""Settings: one declaration, three faces, no silent value."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.settings import build, param, params_of, to_json


@dataclass(frozen=True, kw_only=True)
class Example:
    cloud: Path = param(kind="file", help="Cloud")
    gate_m: float = param(0.5, kind="number", help="Gate", unit="m", minimum=0.1, maximum=2)
    slices: int = param(10, kind="integer", help="Slices", minimum=1)
    fit: str = param("circle", kind="choice", help="Fit", choices=("circle", "cylinder"))
    quick: bool = param(False, kind="flag", help="Quick")
    note: str | None = param(None, kind="text", help="Note")


def test_text_becomes_typed_values():
    made = build(Example, {"cloud": "a.laz", "gate_m": "0.75", "slices": "3", "quick": "yes"})
    assert made == Example(cloud=Path("a.laz"), gate_m=0.75, slices=3, quick=True)
    assert to_json(made)["cloud"] == "a.laz"


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "--cloud is required"),
        ({"cloud": "a", "gatem": 1}, "did you mean 'gate_m'"),
        ({"cloud": "a", "gate_m": "wide"}, "expected a number in m"),
        ({"cloud": "a", "gate_m": 5}, "expected 0.1 to 2 m"),
        ({"cloud": "a", "gate_m": "nan"}, "finite"),
        ({"cloud": "a", "slices": 2.5}, "whole number"),
        ({"cloud": "a", "fit": "square"}, "circle, cylinder"),
        ({"cloud": "a", "quick": "maybe"}, "true or false"),
    ],
)
def test_bad_values_are_refused_in_one_sentence(values, words):
    with pytest.raises(InputError, match=words):
        build(Example, values)


@given(
    st.dictionaries(
        st.sampled_from(["cloud", "gate_m", "slices", "fit", "quick", "note", "other"]),
        st.one_of(st.text(max_size=8), st.floats(), st.integers(), st.booleans(), st.none()),
    )
)
def test_any_input_gives_settings_or_an_input_error(values):
    try:
        made = build(Example, values)
    except InputError:
        return
    assert 0.1 <= made.gate_m <= 2 and made.slices >= 1 and made.fit in ("circle", "cylinder")


def test_declaration_order_and_defaults_are_kept():
    assert [name for name, _, _ in params_of(Example)] == ["cloud", "gate_m", "slices", "fit", "quick", "note"]
