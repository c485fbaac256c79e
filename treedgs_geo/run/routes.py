"""The route straight from photos with cameras to diameters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..core.progress import Reporter
from ..stems.photos.fit_records import KeptFits
from ..stems.photos.options import PhotoStemOptions
from ..stems.photos.route import search_photos
from ..stems.photos.targeted_fit import GivenStems
from ..stems.photos.trees import trees_of_photo_fits
from ..stems.quality.tree import Tree
from .context import Site


@dataclass(frozen=True)
class Found:
    """What a route found. trees: project coordinates. kept: the stems as the photos show them, local frame; the tree
    with ``tree_id`` N is that of ``kept.fits[N - 1]``. facts: what the route adds to the stage's result."""

    trees: list[Tree]
    kept: KeptFits
    facts: dict[str, Any] = field(default_factory=dict)


def photo_route(site: Site, options: PhotoStemOptions, reporter: Reporter, given: GivenStems | None = None) -> Found:
    """Stems found and fitted straight in the photos. given: stems known to stand there."""
    with reporter.placed(site.frame):
        searched = search_photos(site.views, site.ground, site.area, options, reporter, given)
    return Found(trees_of_photo_fits(searched.fits, site.frame), KeptFits(searched.fits, searched.looks))
