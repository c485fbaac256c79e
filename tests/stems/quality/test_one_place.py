"""Flag, reasons, error and interval of a stem change in one place: :mod:`treedgs_geo.stems.quality.assessment`."""

import ast
from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.stems.quality.assessment import Assessment
from treedgs_geo.stems.quality.findings import Findings
from treedgs_geo.stems.quality.limits import judge

LIBRARY = Path(__file__).parents[3] / "treedgs_geo"
#: Rooms whose stems go through it.
ROOMS = ("stems/photos", "stems/cloud", "run")
STATED = {"flag", "reasons", "se_cm", "lo_cm", "hi_cm", "qc_flag", "qc_reason", "dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm"}


def writers(text: str) -> list[int]:
    """Lines that write what is stated of a stem over what was stated before."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "replace":
            found += [node.lineno] * bool({word.arg for word in node.keywords} & STATED)
        if isinstance(node, ast.Assign | ast.AugAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found += [node.lineno for target in targets if isinstance(target, ast.Attribute) and target.attr in STATED]
    return found


def test_nothing_else_writes_over_what_is_stated():
    assert writers("replace(fit, flag='ok')") and writers("tree.qc_flag = 'ok'") and not writers("replace(fit, r0=1)")
    files = [path for room in ROOMS for path in sorted((LIBRARY / room).rglob("*.py"))]
    assert len(files) > 50
    assert {str(path): lines for path in files if (lines := writers(path.read_text(encoding="utf-8")))} == {}


def test_evidence_flags_widens_and_reaches_another_reading():
    ivy = judge("photos", {"covered": 0.24})
    stated = Assessment(30.0, 0.5).adding(ivy, 2.0, 36.0)
    assert (stated.flag, stated.reasons) == ("check", ("covered",))
    assert stated.se_cm == pytest.approx(np.hypot(0.5, 2.0))
    assert stated.lo_cm == pytest.approx(30 - 1.645 * stated.se_cm, abs=0.01) and stated.hi_cm == 36.0
    assert Assessment(30.0, 3.0, 27.0, 33.0).widened(4.0) == Assessment(30.0, 5.0, 25.0, 35.0)
    assert Assessment(30.0, 3.0).widened(4.0).se_cm == 5.0
    # An interval of before is kept; nothing found changes nothing; a reason is listed once.
    assert Assessment(30.0, 0.5, 12.0, 31.0).adding(ivy, 2.0).lo_cm == 12.0
    assert stated.adding(Findings(), 5.0) is stated
    assert stated.adding(ivy).reasons == ("covered",)


def test_a_refusal_stays():
    refused = Assessment(30.0, 0.5).adding(judge("photos", {"covered": 0.5}), 2.0)
    assert not refused.measured and refused.se_cm == 0.5
    later = refused.adding(judge("photos", {"twins": 20.0}), 3.0)
    assert later.reasons == ("covered", "merged") and not later.measured and later.se_cm == 0.5


def test_as_fields_of_a_tree():
    assert Assessment(30.0, 0.5).of_tree()["dbh_lo_cm"] is None
    fields = Assessment(30.0, 0.5, 28.0, 31.0, "check", ("covered", "merged")).of_tree()
    assert (fields["qc_flag"], fields["qc_reason"]) == ("check", "covered,merged") and fields["dbh_hi_cm"] == 31.0
