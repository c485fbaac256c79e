"""The interval that every measured value comes with."""

from __future__ import annotations

#: Probability that the interval of a measured value holds, and its half width in standard errors of a normal error.
LEVEL, HALF_WIDTH_SE = 0.90, 1.645
