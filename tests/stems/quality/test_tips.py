"""Tips of a canopy, and how far each rises above the way to the next."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.stems.quality.tips import rises, tips_of


def test_rises_of_a_crown_beside_a_lonely_cell():
    x, y = np.arange(0, 12, 0.2), np.arange(0, 8, 0.2)
    gx, gy = np.meshgrid(x, y)
    away = np.hypot(gx - 4.0, gy - 4.0)
    height = np.where(away < 1.5, 15 - away, np.nan)
    height[20, 40] = 9.0
    tips = tips_of(x, y, height)
    assert len(tips) == 2 and tips[0] == pytest.approx([4.0, 4.0, 15.0], abs=0.01)
    assert rises(x, y, height, tips) == pytest.approx([15.0, 9.0], abs=0.01)
    bridge = np.where((np.abs(gy - 4.0) < 0.3) & (gx > 5.0) & (gx < 8.0), 8.0, height)
    bridge[20, 40] = 9.0
    assert rises(x, y, bridge, tips)[1] == pytest.approx(1.0, abs=0.01)
