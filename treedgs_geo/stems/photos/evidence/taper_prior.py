"""The taper of a plot's own stems: what a diameter measured farther up is carried down to breast height by.

A stem that only shows 2 to 5 m above the ground has few edges there, and the slope of its radius that they give,
carried down by 2.2 m, would be most of its error. The other stems of the plot say better what a stem loses on the way:
the mean slope of those that are seen well differs from their true loss between breast height and 3.6 m by 0.2 cm at
most (five plots of two renderers; ``docs/evidence/photos.md``), and stems differ from it by
``priors.TAPER_SD``. Butts swell below the heights that are fitted (0.6 m) and are not in it.
"""

from __future__ import annotations

import numpy as np

from ...quality.priors import TAPER_SD, USUAL_TAPER
from ..fit.edge_adjustment import TaperPrior
from ..fit.photo_fit import PhotoFit


def stand_taper(fits: list[PhotoFit]) -> TaperPrior:
    """What the next stem's slope is expected to be: the mean over the stems that are ``ok``, with that of other stands
    (``priors.USUAL_TAPER``) as prior, and the spread of stems about it."""
    slopes = np.array([fit.r1 for fit in fits if fit.flag == "ok" and not fit.carried])
    spread = max(float(slopes.std()), TAPER_SD) if len(slopes) else TAPER_SD
    # Stands differ from each other about as much as stems of one stand do.
    of_stand, of_stems = 1 / TAPER_SD**2, len(slopes) / spread**2
    mean = (of_stand * USUAL_TAPER + float(slopes.sum()) / spread**2) / (of_stand + of_stems)
    return TaperPrior(mean, float(np.sqrt(TAPER_SD**2 + 1 / (of_stand + of_stems))))
