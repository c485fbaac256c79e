"""What is assumed of a stem before it is measured, once for every route: breast height and taper.

Standard library only: settings are declared with these, and commands show them without heavy imports. Compiled kernels
hold these values, and numba's cache follows no imports: after a change here, remove the ``__pycache__`` folders.
"""

from __future__ import annotations

#: Breast height above the ground where no other is given (United States: 4.5 ft), and the lowest and highest
#: that may be given, m. The photo routes compare bark from 0.3 to 2.9 m.
BREAST_HEIGHT_M, LOWEST_BREAST_HEIGHT_M, HIGHEST_BREAST_HEIGHT_M = 1.37, 0.5, 2.5
#: Loss of diameter with height where a stem's own is unknown (planted pine), cm a metre; the same as the slope of the
#: radius, m/m, and how far stems differ from it (1 sd).
USUAL_TAPER_CM_M = 1.0
USUAL_TAPER, TAPER_SD = -0.005, 0.0015
#: Slope of the radius where fits to photos and splats start, and the middle of what counts as plausible there, m/m.
START_TAPER = -0.0045
#: Standard deviation of a stem's width with direction, share of the diameter: 5 % / 2 / sqrt(2) for stems whose widest
#: and narrowest diameters differ by 5 %, as conifers' do on average.
OVAL_SD = 0.018
