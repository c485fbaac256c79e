"""Fit a whole scene as published: all photos, 0.8 L1 + 0.2 (1 - SSIM) + depth-normal term, densification, RLGS.

Everything that happens on the way hangs on the share of the fit that is done, so that a fit of fewer steps than the
published 30,000 goes through the same stations. With a time limit (CPU time) that is the share of the time: the steps
that it leaves are foreseen (:func:`plan`), smaller photos are taken where they are too few, and none is left over.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import torch

from ....core.errors import InputError
from ....core.progress import Reporter
from ..field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION, GaussianField
from ..options import SceneOptions
from ..scene_start import Box, start_scales, thinned
from ..whole_photos import WholePhotos
from .controllers import GROUPS, Rlgs
from .densify import Counts, DensityRule, Pull, grow, to_prune
from .losses import d_ssim, depth_normal, l1, unit_rays
from .scene import RATES, Scene, make_scene_rasteriser, update_filter
from .scene_report import SceneReport

#: Weights as published: of D-SSIM, of the depth-normal term, and the share of the fit from which the latter counts.
SSIM, NORMALS, NORMALS_FROM = 0.2, 0.05, 0.5
#: A degree of harmonics more each so much of the fit (1,000 of 30,000 steps).
_DEGREE_EVERY = 1_000 / 30_000
#: The two reward views change this often in a fit (every 1,000 of 30,000 steps).
_REWARD_BLOCKS = 30
#: Where the positions' steps end, as a share of where they begin.
_LAST_RATE = 0.01
#: Columns of the controllers' (14,) factors by tensor.
_COLUMN = {"means": MEAN.start, "quats": QUATERNION.start, "log_scales": LOG_SCALE.start, "opacity_logits": LOGIT,
           "constant": COLOUR.start}  # fmt: skip
#: Sizes of the photos that are tried for a time limit, and the steps that a size has to leave room for.
FACTORS, MIN_STEPS = (1.0, 0.5, 0.25), 300
#: Gaussians are pruned for their width in a photo from so many times the median of those that the fit began with, if
#: that is more than published: a start that is thinned has wide ones, and hardly any other.
STARTS_WIDE = 2.0
#: How much longer a step takes on average than at the start: Gaussians grow in number, then normals are drawn too.
_GROWTH = 2.0


@dataclass
class SceneFit:
    """A scene while it is fitted; one ``Phase`` of ``free/controllers.py`` after the other."""

    scene: Scene
    photos: WholePhotos
    box: Box
    options: SceneOptions
    rule: DensityRule = field(default_factory=DensityRule)
    steps: int = 0
    tried: int = 0
    counts: Counts = field(default_factory=Counts)
    losses: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.planned, self.began, self.full = self.options.steps, _clock(self.options.device), False
        self.phases_tried = 0
        self.rasteriser = make_scene_rasteriser(self.options.device)
        self.pull = Pull.none(self.scene)
        self.rng = np.random.default_rng(self.options.seed)
        self.generator = torch.Generator().manual_seed(self.options.seed)
        device = self.scene.device
        self.weights = [
            torch.as_tensor((inside > 0.5) & self.box.seen(camera), dtype=torch.float32, device=device)
            for camera, inside in zip(self.photos.cameras, self.photos.inside, strict=True)
        ]
        # A photo that sees nothing of the box has nothing to teach.
        self.usable = [k for k, weight in enumerate(self.weights) if float(weight.sum()) > 0]
        if not self.usable:
            raise InputError("None of the photos shows the plot's box; check the plot's coordinates and the cameras.")
        centres = np.array([camera.centre for camera in self.photos.cameras])
        away = np.linalg.norm(centres - centres.mean(axis=0), axis=1).max()
        self.extent_m = float(1.1 * away)
        self.low, self.high = (torch.as_tensor(side, dtype=torch.float32, device=device)
                               for side in (self.box.low, self.box.high))  # fmt: skip
        self.footprint_m = update_filter(self.scene, self.photos.cameras)
        self.rule = replace(self.rule, wide_px=max(self.rule.wide_px, STARTS_WIDE * self._radius_px()))
        self.order: list[int] = []
        self.last_reset = self.last_grown = 0
        self._split_rewards()

    # What a controller sees ---------------------------------------------------------------------------------------

    @property
    def knobs(self) -> int:
        """Two: the gradient from which Gaussians are split or cloned, and how much a split shrinks."""
        return 2

    @property
    def done(self) -> float:
        """Share of the fit that is done: of the steps or of the time, whichever ends it."""
        limit = self.options.time_limit_min
        by_time = 0.0 if limit is None else self.seconds / (60 * limit)
        return min(max(self.steps / self.options.steps, by_time), 1.0)

    @property
    def seconds(self) -> float:
        """Since the fit began: of the CPU, or of the clock where a GPU works."""
        return _clock(self.options.device) - self.began

    def run(self, factors: np.ndarray, density: np.ndarray | None = None) -> None:
        """One phase of steps."""
        for _ in range(self.options.phase_steps):
            if self.done >= 1:
                return
            self._step(factors, np.ones(2) if density is None else density)

    def save(self) -> Any:
        """Everything that running changes, but the clock."""
        plain = {
            "steps": self.steps,
            "order": list(self.order),
            "last_reset": self.last_reset,
            "last_grown": self.last_grown,
            "counts": Counts(**asdict(self.counts)),
            "losses": list(self.losses),
            "pull": self.pull.clone(),
            "footprint_m": self.footprint_m.clone(),
            "full": self.full,
        }
        return self.scene.save(), plain, self.rng.bit_generator.state, self.generator.get_state()

    def restore(self, state: Any) -> None:
        """Back to a saved state."""
        scene, plain, draws, torch_draws = state
        self.tried += self.steps - plain["steps"]
        self.scene.restore(scene)
        for name, value in plain.items():
            setattr(self, name, value)
        self.order, self.losses = list(self.order), list(self.losses)
        self.counts, self.pull = Counts(**asdict(self.counts)), self.pull.clone()
        self.rng.bit_generator.state = draws
        self.generator.set_state(torch_draws)

    def reward_loss(self) -> float:
        """Mean absolute colour error of the reward views; NaN where there are none."""
        total = mass = 0.0
        with torch.no_grad():
            for k in self.rewards:
                shown = self.scene.render(self.photos.cameras[k], self.rasteriser, self.degree, False)
                off = (shown.colour - self._image(k)).abs().mean(dim=-1)
                total += float((off * self.weights[k]).sum())
                mass += float(self.weights[k].sum())
        return total / mass if mass else float("nan")

    # The fit ------------------------------------------------------------------------------------------------------

    @property
    def degree(self) -> int:
        """Of the harmonics, so far."""
        return min(int(self.done / _DEGREE_EVERY + 1e-9), self.options.degree)

    def fit(self, reporter: Reporter | None = None) -> None:
        """Phase after phase until the schedule or the time limit ends it."""
        reporter = reporter or Reporter()
        controller = Rlgs(seed=self.options.seed) if self.options.controller == "rlgs" else None
        held = np.ones(N_PARAMETERS)
        number, block = 0, 0
        while self.done < 1:
            if controller is not None and number % self.options.tried_every == 0:
                controller.phase(self)
                held = _columns_of(controller) if controller.history else held
            else:
                self.run(held)
            number += 1
            if int(self.done * _REWARD_BLOCKS) > block:
                block = int(self.done * _REWARD_BLOCKS)
                self._split_rewards()
            reporter.progress(self.done)
        self.phases_tried = len(controller.history) if controller is not None else 0

    def _step(self, factors: np.ndarray, density: np.ndarray) -> None:
        if not self.order:
            self.order = [int(k) for k in self.rng.permutation(self.taught)]
        k, done = self.order.pop(), self.done
        for group in self.scene.optimiser.param_groups:
            rate = RATES[group["name"]] * (factors[_COLUMN[group["name"]]] if group["name"] in _COLUMN else 1.0)
            group["lr"] = rate * (self.extent_m * _LAST_RATE**done if group["name"] == "means" else 1.0)
        camera, weight = self.photos.cameras[k], self.weights[k]
        normals = done >= NORMALS_FROM
        shown = self.scene.render(camera, self.rasteriser, self.degree, normals)
        loss = photometric(shown.colour, self._image(k), weight)
        if normals:
            loss = loss + NORMALS * depth_normal(shown, unit_rays(camera, weight.device), weight)
        self.scene.optimiser.zero_grad()
        loss.backward()
        for tensor in self.scene.tensors.values():
            if tensor.grad is not None:
                torch.nan_to_num_(tensor.grad, nan=0.0, posinf=0.0, neginf=0.0)
        self.pull.add(shown.pull, camera.width, camera.height)
        self.scene.optimiser.step()
        self.steps += 1
        self.losses.append(float(loss.detach()))
        self._density(density)

    def _density(self, knobs: np.ndarray) -> None:
        """Whatever of the densification is due after a step."""
        rule, done = self.rule, self.done
        # Every photo has to have had its say before Gaussians are judged.
        every = max(round(rule.every * self.planned), len(self.taught))
        due = self.steps - self.last_grown >= every
        rest = self.steps - self.last_reset
        if due and rule.begin <= done < rule.end:
            reset = self.last_reset > 0
            room = self.options.max_gaussians - len(self.scene)
            split, cloned = grow(self.scene, self.pull, self.extent_m, room, rule, self.generator, *knobs)
            self.footprint_m = update_filter(self.scene, self.photos.cameras)
            means = self.scene.tensors["means"].detach()
            inside = ((means >= self.low) & (means <= self.high)).all(dim=1)
            faint = not reset or rest >= rule.rest_steps
            gone = to_prune(self.scene, inside, self.footprint_m, self.extent_m, rule, reset, faint)
            if bool(gone.all()):
                raise InputError(
                    "The published pruning left no Gaussian of the scene; give more photos, or a longer --time-limit."
                )
            self.scene.keep(~gone)
            self.footprint_m = self.footprint_m[~gone]
            counts = self.counts
            counts.split, counts.cloned = counts.split + split, counts.cloned + cloned
            counts.pruned += int(gone.sum())
            self.full |= len(self.scene) >= self.options.max_gaussians
        elif due:
            self.footprint_m = update_filter(self.scene, self.photos.cameras)
        if due:
            self.pull, self.last_grown = Pull.none(self.scene), self.steps
        if done < rule.end - rule.reset and rest >= max(round(rule.reset * self.planned), 3 * rule.rest_steps):
            self.scene.fade(rule.reset_to)
            self.last_reset = self.steps

    @property
    def taught(self) -> list[int]:
        """Photos that take part now."""
        return [k for k in self.usable if k not in self.rewards]

    def _split_rewards(self) -> None:
        """Two other photos that the controller is measured on."""
        enough = self.options.controller == "rlgs" and len(self.usable) >= 6
        self.rewards = sorted(int(k) for k in self.rng.choice(self.usable, 2, replace=False)) if enough else []
        self.order = []

    def _radius_px(self) -> float:
        """Median radius (3 sigma) of the Gaussians in the nearest photo of each."""
        scale = torch.exp(self.scene.tensors["log_scales"].detach()).max(dim=1).values
        return float((3 * scale / self.footprint_m.clamp_min(1e-9)).median())

    def _image(self, k: int) -> torch.Tensor:
        image = torch.as_tensor(self.photos.images[k], device=self.weights[k].device)
        return image.to(torch.float32) / 255

    def report(self, first: int) -> SceneReport:
        """What was done. first: Gaussians at the start."""
        limit, tenth = self.options.time_limit_min, max(len(self.losses) // 10, 1)
        late = limit is not None and self.steps < self.options.steps
        sizes = [camera.width * camera.height for camera in self.photos.cameras]
        return SceneReport(
            photos=len(self.photos),
            factor=self.options.factor,
            megapixels=round(sum(sizes) / 1e6, 2),
            steps_planned=self.planned,
            steps=self.steps,
            tried=self.tried,
            gaussians_first=first,
            gaussians=len(self.scene),
            full=self.full,
            wide_px=round(self.rule.wide_px, 1),
            counts=asdict(self.counts),
            controller=self.options.controller,
            phases_tried=self.phases_tried,
            cpu_s=round(self.seconds, 1),
            ended="time limit" if late else "schedule",
            loss=(float(np.mean(self.losses[:tenth])), float(np.mean(self.losses[-tenth:]))),
        )


def photometric(shown: torch.Tensor, image: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """0.8 L1 + 0.2 (1 - SSIM), as the published fits have it (twice :func:`.losses.d_ssim`)."""
    return (1 - SSIM) * l1(shown, image, weight, 1e-3) + SSIM * 2 * d_ssim(shown, image, weight)


def _clock(device: str) -> float:
    """Seconds of the CPU, or of the clock where a GPU works."""
    return time.process_time() if device == "cpu" else time.perf_counter()


def plan(seconds_a_step: float, limit_s: float, options: SceneOptions) -> int:
    """Steps that fit into a time limit at this speed of the first steps, the controller's trials counted."""
    each = 1.0
    if options.controller == "rlgs":
        # A phase that is tried runs seven times, and is measured on two photos as often.
        each += (6 + 14 / (3 * options.phase_steps)) / options.tried_every
    return max(min(int(limit_s / (seconds_a_step * _GROWTH * each)), options.steps), 1)


def _columns_of(controller: Rlgs) -> np.ndarray:
    """(14,) the factors of the rates that won the last trials."""
    factors = np.ones(N_PARAMETERS)
    for columns, value in zip(GROUPS, controller.history[-1]["factors"], strict=True):
        factors[columns] = value
    return factors


def fit_scene(
    photos: WholePhotos,
    box: Box,
    points: np.ndarray,
    colours: np.ndarray,
    options: SceneOptions | None = None,
    reporter: Reporter | None = None,
) -> tuple[GaussianField, SceneReport]:
    """The published fit of a whole scene.

    Args:
        photos: all of them, undistorted, at full size. box: what is modelled. points, colours: (M, 3) local metres and
            (M, 3) 0..1, of the dense prior.

    Returns:
        The Gaussians in the box, 3D filter worked in, and how far the fit came.

    Raises:
        InputError: no point lies in the box, or no photo shows it.
    """
    options = options or SceneOptions()
    inside = box.contains(points)
    if not inside.any():
        raise InputError(
            f"None of the {len(points):,} points of the dense prior lies in the plot's box, so there is nothing to "
            "start Gaussians from; give a cloud of this plot with --dense."
        )
    points, colours = thinned(points[inside], colours[inside], max(options.max_gaussians // 2, 1))
    threads = torch.get_num_threads()
    # Sums over threads would depend on their number: the same bits on any machine.
    torch.set_num_threads(1)
    try:
        fit = _prepared(photos, box, points, colours, options)
        first = len(fit.scene)
        fit.fit(reporter)
        field_ = fit.scene.field()
        return field_.select(box.contains(field_.means.astype(float))), fit.report(first)
    finally:
        torch.set_num_threads(threads)


def _prepared(
    photos: WholePhotos, box: Box, points: np.ndarray, colours: np.ndarray, options: SceneOptions
) -> SceneFit:
    """A fit at the size of photos, and with the number of steps, that the time limit leaves room for."""
    began = _clock(options.device)
    wanted = (options.factor,) if options.factor else (FACTORS if options.time_limit_min else (1.0,))
    for factor in wanted:
        own = reduced(photos, factor)
        chosen = replace(options, factor=factor)
        scales = start_scales(points)
        fit = SceneFit(Scene(points, colours, scales, options.degree, options.device), own, box, chosen)
        fit.began = began
        if options.time_limit_min is None:
            return fit
        # A first few steps say how fast this machine is; they are taken back.
        state = fit.save()
        fit._step(np.ones(N_PARAMETERS), np.ones(2))
        start = fit.seconds
        for _ in range(3):
            fit._step(np.ones(N_PARAMETERS), np.ones(2))
        each = (fit.seconds - start) / 3
        fit.restore(state)
        fit.tried = 0
        fit.planned = plan(each, 60 * options.time_limit_min - fit.seconds, options)
        if fit.planned >= min(MIN_STEPS, options.steps):
            break
    return fit


def reduced(photos: WholePhotos, factor: float) -> WholePhotos:
    """The same at a smaller size."""
    if factor == 1:
        return photos
    found = WholePhotos([], [], [])
    for k in range(len(photos)):
        camera, image, inside = photos.at(k, factor)
        found.cameras.append(camera)
        found.images.append(np.round(image * 255).astype(np.uint8))
        found.inside.append(inside)
    return found
