"""Settings of ground classification (standard library only: commands show them without heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.settings import param


@dataclass(frozen=True, kw_only=True)
class ClothSimulation:
    """Cloth simulation filter (Zhang et al. 2016), with the settings that forest clouds are usually given.

    Of the library only: ground_m: points this close to the final surface are ground. rounds: most iterations of the
    cloth. thin_m: one lowest point a cell of this size, metres, hangs the cloth.
    """

    cloth_m: float = param(0.5, help="cell size of the cloth", unit="m", minimum=0.1, maximum=10)
    rigidness: int = param(2, help="1 steep, 2 hilly, 3 flat terrain", minimum=1, maximum=3)
    threshold_m: float = param(
        0.5, help="largest distance of ground points from the cloth", unit="m", minimum=0.02, maximum=5
    )
    ground_m: float = 0.15
    rounds: int = 500
    thin_m: float = 0.2
