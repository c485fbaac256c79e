"""What kinds of clouds look like, and how noisy a cloud is: bark as thick as its scanner and its drift make it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...geometry.cone import Cone

#: Bark is not taken to be thicker than this (1 sd), m: beyond it, a ring can no longer be distinguished from a shrub.
MAX_NOISE_M = 0.035
#: Side of the voxels in which the points of a dense cloud are limited, m: as the lattice of tiles and their buffers.
CROWDED_M = 0.5
#: Cap on the spread of a stem's bark, in the cloud's noise.
CAP_NOISE = 2.0
#: A ring that is this much thicker than the cloud's bark usually is, is a shrub or twigs around a thinner stem.
FUZZY = 1.75


@dataclass(frozen=True)
class Sensor:
    """What a kind of cloud looks like: noise floor and cap on bark, points kept (at most ``max_points`` a voxel of
    ``voxel_m``), points needed, filled stems or shells, the usual noise, whether
    standard errors were calibrated on such clouds with known diameters, and the spread beyond which a ring is no bark
    (known where the cloud's noise is)."""

    floor_m: float
    cap_m: float
    voxel_m: float
    max_points: int
    least_points: int
    solid: bool
    noise_m: float
    calibrated: bool = False
    fuzzy_m: float = float("inf")

    def at_noise(self, noise_m: float) -> Sensor:
        """The same for a cloud whose noise was measured: it counts where it is more than usual."""
        noise_m = min(max(noise_m, self.noise_m), MAX_NOISE_M)
        return replace(self, noise_m=noise_m, cap_m=max(self.cap_m, CAP_NOISE * noise_m), fuzzy_m=FUZZY * noise_m)


SENSORS = {
    "tls": Sensor(0.004, 0.02, CROWDED_M, 1000, 60, False, 0.010),
    "uls": Sensor(0.007, 0.025, CROWDED_M, 1000, 16, False, 0.012, calibrated=True),
    "splat": Sensor(0.010, 0.05, 0.015, 1, 40, True, 0.03),
}


def tolerance(cone: Cone, sensor: Sensor) -> float:
    """Points closer than this to a cone's bark lie on it, m."""
    return max(3 * cone.sigma, 0.02, 2 * sensor.floor_m)
