"""The engine's messages as QGIS feedback, in words for a technician, with the time left."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from typing import Any

import qgis.utils
from qgis.core import QgsProcessingFeedback
from qgis.PyQt.QtCore import QCoreApplication

from .i18n import tr

#: QGIS keeps every estimate as a line of its log: not too many of them.
ESTIMATE_EVERY_S = 20
#: The engine's stages in plain words; one that is not here keeps its own name.
STAGES = {
    "geotag": "Camera positions",
    "geotags": "Camera positions",
    "reconstruct": "Cameras from the photos",
    "guided by geotags and gimbals": "Photos matched where geotags and gimbal say",
    "guided by the block so far": "Photos matched again, where the first cameras say",
    "without a guide": "All photos matched anew",
    "features": "Features in each photo",
    "matching": "Same points in several photos",
    "mapping": "First placing of the cameras",
    "adjustment": "Fine adjustment of the cameras",
    "dense": "Dense points",
    "ground": "Ground under the trees",
    "terrain": "Ground under the trees",
    "measure": "Stems and their diameters",
    "find stems": "Looking for stems",
    "fit stems": "Fitting each stem",
    "stems that the network sees": "Asking the network for stems",
    "stems seen farther up": "Measuring hidden stems farther up",
    "measure stems": "Measuring each stem",
    "stems": "Stems, found and fitted",
    "heights": "Heights of the trees",
    "orthophoto": "Picture of the ground",
    "view": "Stand in three dimensions",
    "canopy": "Looking for treetops",
    "tag photos": "Writing tagged copies of the photos",
    "draw": "Drawing trees",
    "check": "Comparing with the tapes",
    "stand": "Growing the stand",
    "photos": "Drawing the photos",
    "lidar": "LiDAR cloud",
    "truth": "Writing field table and truth",
    "score": "Comparing with the field trees",
    "experiments": "Published methods on the same trees",
    "figures of the paper": "Tables and figures of the paper",
    "methods": "Circles and cylinders on both clouds",
    "visibility and runtime": "Photos that show breast height, and time",
    "dense prior": "Dense points to start from",
    "stereo": "Stereo of neighbouring photos",
    "fit Gaussians": "Fitting Gaussians",
    "sample surface": "Surface points",
    "segment stems": "Telling stems from the rest",
    "read cloud": "Reading the point cloud",
    "pair trees": "Pairing field and measured trees",
    "given stems": "Stems at the places given",
    "given": "Stems measured at places given before",
    "flights": "Comparing flights",
    "sheets": "A picture of the evidence for each tree",
    "compile": "Compiling for this processor",
    "write": "Writing layer and report",
    "read": "Reading the tables",
    "estimate": "Estimating per hectare",
}


def is_cancelled(feedback: QgsProcessingFeedback) -> bool:
    """Whether the user asked to stop.

    ``qgis_process`` learns of Ctrl-C through its event loop, which nobody runs while we wait: so it is run here. With
    a window open the window's own thread does that, and running it here could re-enter what it is doing.
    """
    if qgis.utils.iface is None:
        QCoreApplication.processEvents()
    return feedback.isCanceled()


class Listener:
    """Turns the engine's messages into QGIS feedback; what native libraries print stays in ``engine.log``.

    words: the engine's names as those of QGIS. stem: gets each stem as it is measured, where there are windows.
    """

    def __init__(
        self,
        feedback: QgsProcessingFeedback,
        words: Callable[[str], str] = str,
        stem: Callable[[dict[str, Any]], None] | None = None,
    ) -> None:
        self.feedback, self.words, self.stem = feedback, words, stem
        self.reported, self.long = time.monotonic(), False
        self.stages: list[str] = []

    def __call__(self, message: dict[str, Any]) -> None:
        """One message of the protocol (docs/developer/engine.md)."""
        kind, text = message["t"], self.words(str(message.get("message", "")))
        if kind == "progress":
            fraction = float(message.get("fraction", 0))
            self.feedback.setProgress(100 * fraction)
            now = time.monotonic()
            if message.get("eta_s") and now - self.reported > ESTIMATE_EVERY_S:
                self.reported = now
                if self.stem is not None and not self.long:
                    self.long = True
                    self.feedback.pushInfo(
                        tr("You may close this window: the run goes on, and its results come to the map.")
                    )
                stage = f"{self.stages[-1]}: " if self.stages else ""
                left = tr("about {time} left").format(time=duration(message["eta_s"]))
                self.feedback.setProgressText(f"{stage}{100 * fraction:.0f} %, {left}")
        elif kind == "stage":
            self.stages.append(stage_name(message))
            # Also beside the bar, in place of the time that the stage before had left.
            self.feedback.setProgressText(f"{'  ' * (len(self.stages) - 1)}{self.stages[-1]} …")
        elif kind == "stage_done":
            if self.stages:
                self.stages.pop()
            self.feedback.pushInfo(
                f"{'  ' * len(self.stages)}{stage_name(message)}: {duration(message.get('seconds', 0))}"
            )
        elif kind == "info":
            self.feedback.pushInfo(f"{'  ' * len(self.stages)}{text}")
        elif kind == "warn":
            self.feedback.pushWarning(text)
        elif kind == "stem" and self.stem is not None:
            self.stem(message)


def stage_name(message: dict[str, Any]) -> str:
    """The stage in words; those that carry a number or a plot's name keep it."""
    name = str(message.get("name", ""))
    if found := re.fullmatch(r"stems in the photos \((\d+) of (\d+)\)", name):
        return tr("Stems in the photos, area {number} of {all}").format(number=found.group(1), all=found.group(2))
    if name not in STAGES and (found := re.fullmatch(r"dense (.+)", name)):
        return tr("Dense points of plot {plot}").format(plot=found.group(1))
    return tr(STAGES.get(name, name))


def duration(seconds: float) -> str:
    """``95`` -> ``1 min 35 s``; ``3.2`` -> ``3.2 s``; ``4000`` -> ``1 h 06 min``."""
    if seconds < 10:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(int(seconds), 60)
    if minutes >= 60:
        return f"{minutes // 60} h {minutes % 60:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
