"""What the search of stems in photos was tuned to, step by step: what another value would find differently.

Set until 2026-11-25 on ``plot_a``, ``plot_e`` and, where it says *hard*, on simulated hard stands (seeds 401 to 426),
with the true cameras (``treedgs_lab/benchmarks/photos/stems_from_photos.py``); other data are named beside their value.
None of these plots is scored as held out (``docs/evidence/photos.md``). Limits of quality are in
:mod:`treedgs_geo.stems.quality.limits`, what is known of stems in :mod:`treedgs_geo.stems.quality.priors`. Sizes of
tables, steps of searches and the like, which change the time and hardly the result, stand where they are used.

Compiled kernels hold these values, and numba's cache follows no imports: after a change here, remove the
``__pycache__`` folders.
"""

from __future__ import annotations

import numpy as np

from ..quality.findings import Bound
from ..quality.limits import bound_of

# Photos and the ground behind the stems
#: Photos that have to show a place for a stem to be measured there.
MIN_PHOTOS = 3
#: Widest piece of ground searched at once, m (bounds memory).
TILE_M = 26.0
#: Height of the stem piece over which an edge must be straight, m.
STRAIGHT_M = 0.28
#: Photos a flight needs for a ground of its own: twice those of a stem, which hides it from some.
MIN_FLIGHT_VIEWS = 2 * MIN_PHOTOS
#: Noise floors and ceilings of the ground's colour: luma, and the two colour differences.
FLOOR = np.array([0.030, 0.008, 0.008], np.float32)
CEILING = np.array([0.060, 0.020, 0.020], np.float32)
#: Silhouettes: height of a row (m) and rows a block; half width and sample spacing, m; how far beside the stem the
#: ground is compared, m.
ROW_M, BLOCK_ROWS = 0.05, 10
REACH_M, STEP_M, BESIDE_M = 0.75, 0.01, 0.25
#: Sharpness of photos, descending, and the error of a diameter at it (px, one standard deviation, shared by all
#: photos): rendered photos blurred by 0.6 to 1.5 px, in light and as coded (``docs/results/altered_photos.json``).
SHARP, SOFT_PX = (0.50, 0.40, 0.345), (0.0, 0.3, 0.65)
#: The same where all edges lie before overexposed sky (px): in photos blurred by 0.55 px a sky half a stop above white
#: makes a diameter smaller by 0.6 px, one stop by 1.0, two by 1.6 (calculated).
CLIPPED_PX = 0.8
#: Share of a stem's radius in which bark is compared: away from its blurred edges.
INSIDE = 0.85

# Votes of edges
#: Layers of the stem: height of one, and of the first above the ground, m; how many. Cell of the grid, m.
LAYER_M, N_LAYERS, EDGE_CELL_M = 0.5, 9, 0.05
#: Probability that a photo sees a stem, and the mean of its z-score when it does; a photo above that shows it clearly.
SEEN_PRIOR, SEEN_MEAN_Z = 0.35, 2.5
#: Seeds are this far apart, m; half as far beside a found stem, which may be a second one.
APART_M = 0.4
#: This far from a stem nothing of it is left, m.
STEM_FREE_M = 0.7
#: A lean costs seeds this much (log likelihood units per (m/m)^2), and is searched up to this, degrees; steeper ones
#: the network sees.
LEAN_COST, UPRIGHT_MAX_DEG = 60.0, 10.0
#: The threshold lies this far above the best decoy, and never below the minimum (log likelihood units). Decoys are
#: photos moved this far, m.
ABOVE_CHANCE, MIN_THRESHOLD = 3.0, 8.0
DECOY_M = STEM_FREE_M, 3.0
#: Seeds this far below the threshold are still fitted (log likelihood units); how many at most.
REACH_BELOW, MAX_SEEDS = 22.0, 90
#: Second stems are looked for this close to a found one, m.
SECOND_M = 0.6

# Lines through what the network sees
#: Layers above ground and cell, m.
HEIGHTS, CELL_M = np.arange(0.5, 3.01, 0.25), 0.10
#: Leans are this far apart (m/m).
LEAN_STEP = 0.05
#: The lines leave the searched ground by this much on their way, m.
RIM_M = 0.8
#: A line of the network is looked at from this part of what chance reaches, and is a stem for certain above this.
LINE_SCORE, CERTAIN_SCORE = 1.0, 1.2
#: Radius that a place is first looked at with, m; places that lie nearer each other are one, and so are those this near
#: to a known stem's bark.
START_RADIUS_M = 0.12

# Calibration of a piece of ground
#: Random places at which the silhouettes of no stem are measured, where the network says where stems are (these are
#: ``STEM_FREE_M`` away), and how many are needed.
MORE_PLACES, MIN_PLACES = 32, 8

# Search and adjustment of a stem
#: Weight of opposite colour gradients on the two sides, and of single edges.
SIGN_WEIGHT, SINGLE_WEIGHT = 0.8, 0.1
#: z-scores count up to this.
Z_CAP = 8.0
#: Edge scores (log likelihood units): that chance reaches; from which a stem is there, whatever else speaks against it
#: (below, a seed is not worth refining); from which a silhouette and they make one; by which one explanation clearly
#: leads another.
CHANCE_LLR, THERE_LLR, FEW_LLR, LEAD_LLR = 50.0, bound_of("photos", "llr", "check"), 12.0, 30.0
#: From which edges alone make one.
CLEAR_LLR = bound_of("photos", "llr_alone", "check")
#: Edge score that one unit of silhouette contrast (what chance reaches) is worth where both pull at a shape.
PULL = 400.0
#: Inlier sd of an edge, px; edges are looked for this far from where they are expected, px, cut by cut.
EDGE_SD_PX = 0.45
WINDOWS_PX = 2.6, 2.4, 2.2
#: Prior sd of an axis' curvature, 1/m.
CURVATURE_SD = 0.004

# Which explanation
#: Log odds of an explanation per unit of each witness: silhouette contrast (of what chance reaches), sub-pixel evidence
#: (log likelihood, per 300), squared taper deviation (of 0.3 cm/m, at most 9), edge residual (per 0.1 px). A
#: conditional logit over the explanations of stems with known diameters; the same where the silhouettes are also the
#: network's.
PLAIN_ODDS, NETWORK_ODDS = np.array([1.06, 2.73, -1.7, -1.5]), np.array([4.1, 2.3, -0.6, -1.6])
#: Explanations whose diameters differ less than this are one answer, cm.
SAME_DBH_CM = 2.0
#: Edge score that a log odd is worth: at a lead of 10 an explanation is nine times as probable.
EDGES_A_LOG_ODD = 10.0 / np.log(9)
#: Best silhouettes that are followed as they are; starts and pairs that are followed by a whole fit; starts see this
#: far round themselves, m.
MAX_SETTLED, MAX_FOLLOWED, START_M = 2, 3, 0.3

# Two stems for one
#: The prior of a stem's radius is so many times as wide as the stand's radii spread; two stems that were taken for one
#: are thicker than the stand's by more than so many standard deviations, where edges alone say that they are two.
PRIOR_SDS, THICKER_SD = 2.0, 2.5
#: What touches lies this close (blur, pose, bark), m; two stems lean alike by this much (sd, m/m).
TOUCH_M, PAIR_LEAN_SD = 0.012, 0.035
#: Two alike in one disc: radii as shares of the disc's, the least allowed; how far they may reach beyond it and their
#: barks lie apart (sd), m; thinner discs are not split, m.
PARTS, MIN_PART = (0.4, 0.5, 0.6), 0.25
BEYOND_M, APART_SD_M, MIN_SPLIT_M = 0.02, 0.03, 0.05

# The error of a diameter
#: Weights of what makes it up (:class:`.quality_control.ErrorParts`): maximum likelihood over fits of 46
#: plots (``docs/results/wrong_diameters.json``), with those of earlier fits as prior; the section is a share of the
#: diameter.
ERROR_WEIGHTS = {
    "scatter": 2.7,
    "formal": 3.0,
    "oval": 3.1,
    "seen_oval": 4.4,
    "section": 0.0043,
    "lean": 0.03,
    "taper": 1.9,
    "above": 1.1,
    "soft": 0.79,
}
#: An oval that the photos show counts above this share of the diameter (half of widest less narrowest); its prior sd.
OVAL_FREE, OVAL_PRIOR = 0.005, 0.05
#: Slopes of the radius this far from the usual one are common (m/m).
TAPER_FREE = 0.002
#: Standard error of the reading from above, cm (80 stems, *hard*); a fit's own counts up to this there, cm; and by how
#: much it may move a diameter.
ABOVE_SE_CM, MAX_SE_CM, MAX_MOVED = 0.9, 1.0, Bound(3.0, 0.08)
#: Standard deviation of a wrong diameter, share of it: the 39 wrong ones of the plots that set the weights are 7 cm off
#: at the median, as it makes them; eight are 20 to 45 cm off.
WRONG_SD = 0.3

#: Probability of each diameter that stays open beside the one that is stated: the 90 % interval reaches it (chosen).
OPEN_SHARE = 0.1

# Silhouettes, opacity, ivy, the network
#: The silhouette reads this much thinner than the edges, cm: ground shows through at the blurred rim. With the network
#: it reads thicker: a pixel that is partly stem is likely to be taken for stem.
OUTLINE_OFFSET_CM, NETWORK_OFFSET_CM = 1.0, -0.7
#: A photo counts as seeing the stem from this probability on, and an edge as the stem's.
SEES = 0.5
#: Likeness of neighbouring photos on the bark from which it is bark: 12 things that were none, in two walked plots,
#: reach 0.14.
BARK = 0.25
#: Correlation from which the ground counts as seen through a stem, in this share of its radius.
SEEN_CORRELATION, CORE = 0.7, 0.7
#: Ivy is looked for this far up and down from breast height, m; how much thicker it makes a stem, cm: leaves stand 3 to
#: 8 cm off the bark on both sides.
ABOUT_M, COVER_CM = 0.6, 16.0
#: Finer pixels where the stems stand are averaged to about this width for the network, m; it was trained from 0.009 to
#: 0.037.
COLUMN_M = 0.02
#: What the network says of an edge: from which share of the stem's width (the inner part of it) at its height taken for
#: bark it counts in full, and the part that it counts for without any; how far to both sides of it bark is asked for,
#: px; from which step of its probability it counts in full, and the part without any.
WHOLE_SHARE, INNER, MIN_SHARE = 0.5, 0.75, 0.05
STEP_PX, CLEAR_STEP, MIN_STEP = 1.5, 0.5, 0.1
#: Likelihood of ground where a stem stands, of that where none does: poses err, stems sway. No rarer are stems.
GROUND_RATIO, RAREST_STEM = 0.1, 0.01
#: What a certain stem is worth in a silhouette, beside the ground's -0.9 to 3.2.
SHARE_WEIGHT = 4.0
