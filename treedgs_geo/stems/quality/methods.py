"""Which method measured a tree: the values of ``method`` in the layer."""

from __future__ import annotations

#: Cross-section and estimator of the cloud route, and what weighs its points, in words.
_ESTIMATORS = {
    "default": "tapering cone and slices",
    "paper": "published circles and taper",
    "cylinder-default": "cylinder, brought to breast height",
    "cylinder-paper": "published cylinder",
}
_WEIGHTS = {
    "none": "unweighted",
    "intensity": "weighted by intensity",
    "opacity": "weighted by opacity",
}


def points_method(fit: str, method: str, weights: str) -> str:
    """Key in :data:`METHODS` of the settings ``fit``, ``method`` and ``weights`` of ``measure-dbh``."""
    return f"points-{method if fit == 'circle' else f'cylinder-{method}'}-{weights}"


#: method -> what it is
METHODS: dict[str, str] = {
    "photos": "stem edges and silhouettes in the photos",
} | {
    f"points-{estimator}-{weights}": f"points: {by}, {weighted}"
    for estimator, by in _ESTIMATORS.items()
    for weights, weighted in _WEIGHTS.items()
}
