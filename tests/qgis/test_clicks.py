"""Real clicks on "Set up now" and Stop, in real QGIS, with garbage collected between all of them."""

from __future__ import annotations


def test_the_set_up_bar_lives_as_long_as_it_is_shown(qgis, tmp_path):
    report = tmp_path / "seen.json"
    home = tmp_path / "home"
    seen = qgis.windows("clicks_inside.py", report, ("TREEDGS_PYTHON",), TREEDGS_CLICKS=report, TREEDGS_HOME=home)
    for turn in ("dialog", "first", "second"):
        (early,), (late,) = seen[f"{turn}_bar"]
        assert 0 < early < late, seen
        assert seen[f"{turn}_ended"]
    sentence, offered, stop = seen["meanwhile"]
    assert "is being set up" in sentence and offered and stop == ["Stop"], seen
    assert "Stopped" in seen["first_words"][0] and seen["first_buttons"] == ["Set up now"]
    assert "The engine is set up" in seen["second_words"][0] and seen["second_buttons"] == []
