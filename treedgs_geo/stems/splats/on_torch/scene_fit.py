"""Fit a whole scene as published: all photos, 0.8 L1 + 0.2 (1 - SSIM) + depth-normal term, densification, RLGS.

Everything that happens on the way hangs on the share of the fit that is done, so that a fit of fewer steps than the
published 30,000 goes through the same stations. With a time limit (CPU time) that is the share of the time: the steps
that it leaves are foreseen (:func:`plan`), smaller photos are taken where they are too few, and none is left over.
"""

from __future__ import annotations

import copy
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from ....core.errors import InputError
from ....core.progress import Reporter
from ..field import GaussianField
from ..options import PUBLISHED_STEPS, SceneOptions
from ..scene_start import Box, WholePhotos, start_scales, thinned
from .losses import depth_normal, photometric, unit_rays
from .project import placed
from .rlgs import KNOBS, SCALED, TRIALS, Rlgs
from .scene import RATES, DensityRule, Scene, grow, to_prune, update_filter

#: Weight as published of the depth-normal term, and the share of the fit from which it counts.
NORMALS, NORMALS_FROM = 0.05, 0.5
#: A degree of harmonics more, up to the third, each so much of the fit (1,000 of 30,000 steps).
_DEGREE_EVERY, _MAX_DEGREE = 1_000 / 30_000, 3
#: The two reward views change this often in a fit (every 1,000 of 30,000 steps).
_REWARD_BLOCKS = 30
#: Where the positions' steps end, as a share of where they begin.
_LAST_RATE = 0.01
#: Sizes of the photos that are tried for a time limit, and the steps that a size has to leave room for.
FACTORS, MIN_STEPS = (1.0, 0.5, 0.25), 300
#: Steps that say how fast this machine is.
_TRIED_STEPS = 4
#: How much longer a step takes on average than at the start: Gaussians grow in number, then normals are drawn too.
_GROWTH = 2.0

#: What of a :class:`SceneFit` goes into a file beside its state.
_KEPT = ("planned", "tried", "rewards")


@dataclass
class Progress:
    """What the steps of a fit change beside the scene.

    steps: done so far. order: photos of this round that are still to come. last_reset, last_grown: steps at the last
    reset of the opacities and the last densification. split, cloned, pruned: Gaussians so far. losses: one a step,
    on the device, so that no step waits for another's.
    pull: (2, N) of :func:`.scene.grow`. full: no more Gaussians were allowed.
    """

    pull: torch.Tensor
    order: list[int]
    losses: torch.Tensor
    steps: int = 0
    last_reset: int = 0
    last_grown: int = 0
    split: int = 0
    cloned: int = 0
    pruned: int = 0
    full: bool = False


class SceneFit:
    """A scene while it is fitted, phase after phase."""

    def __init__(self, scene: Scene, photos: WholePhotos, box: Box, options: SceneOptions) -> None:
        self.scene, self.photos, self.box, self.options = scene, photos, box, options
        self.planned, self.began, self.tried = options.steps, _clock(options.device), 0
        self.rng = np.random.default_rng(options.seed)
        self.generator = torch.Generator().manual_seed(options.seed)
        self.controller = Rlgs(options.seed)
        device = scene.device
        # All photos stay on the device, as bytes.
        self.images = [torch.as_tensor(image, device=device) for image in photos.images]
        self.weights = [
            torch.as_tensor((inside > 0.5) & box.seen(camera), device=device)
            for camera, inside in zip(photos.cameras, photos.inside, strict=True)
        ]
        # A photo that sees nothing of the box has nothing to teach.
        self.usable = [k for k, weight in enumerate(self.weights) if bool(weight.any())]
        if not self.usable:
            raise InputError("None of the photos shows the plot's box; check the plot's coordinates and the cameras.")
        centres = np.array([camera.centre for camera in photos.cameras])
        self.extent_m = float(1.1 * np.linalg.norm(centres - centres.mean(axis=0), axis=1).max())
        losses = torch.zeros(max(options.steps, _TRIED_STEPS), device=device)
        update_filter(scene, photos.cameras)
        self.now, self.rule = Progress(self._no_pull(), [], losses), DensityRule()
        self._split_rewards()

    # What the controller sees -------------------------------------------------------------------------------------

    @property
    def done(self) -> float:
        """Share of the fit that is done: of the steps or of the time, whichever ends it."""
        limit = self.options.time_limit_min
        by_time = 0.0 if limit is None else self.seconds / (60 * limit)
        return min(max(self.now.steps / self.options.steps, by_time), 1.0)

    @property
    def seconds(self) -> float:
        """Since the fit began: of the CPU, or of the clock where a GPU works."""
        return _clock(self.options.device) - self.began

    def run(self, factors: np.ndarray, density: np.ndarray) -> None:
        """One phase of steps. factors: (5,) of the rates of :data:`.rlgs.SCALED`. density: (2,) of the knobs."""
        for _ in range(self.options.phase_steps):
            if self.done >= 1:
                return
            self.step(factors, density)

    def wait(self) -> None:
        """Until a GPU has done what it was given."""
        if self.scene.device.type == "cuda":
            torch.cuda.synchronize(self.scene.device)

    def save(self) -> Any:
        """Everything that running changes, but the clock."""
        return self.scene.save(), copy.deepcopy(self.now), self.rng.bit_generator.state, self.generator.get_state()

    def restore(self, state: Any) -> None:
        """Back to a saved state."""
        scene, now, draws, torch_draws = state
        self.tried += self.now.steps - now.steps
        self.scene.restore(scene)
        self.now = copy.deepcopy(now)
        self.rng.bit_generator.state = draws
        self.generator.set_state(torch_draws)

    def keep(self, path: Path) -> None:
        """Write what :meth:`go_on` needs; not in it are RLGS's policies, which begin anew."""
        scene, now, draws, torch_draws = self.save()
        state = {"scene": scene, "now": vars(now), "draws": draws, "torch_draws": torch_draws, "seconds": self.seconds}
        part = path.with_suffix(".part")
        torch.save(state | {name: getattr(self, name) for name in _KEPT}, part)
        part.replace(path)

    def go_on(self, path: Path) -> None:
        """From where the fit of the same photos and points stood that wrote ``path``."""
        state = torch.load(path, map_location=self.scene.device, weights_only=True)
        self.restore((state["scene"], Progress(**state["now"]), state["draws"], state["torch_draws"].cpu()))
        for name in _KEPT:
            setattr(self, name, state[name])
        self.began = _clock(self.options.device) - state["seconds"]

    def reward_loss(self) -> float:
        """Mean absolute colour error of the reward views; NaN where there are none."""
        total = mass = 0.0
        with torch.no_grad():
            for k in self.rewards:
                shown = self.scene.render(self.photos.cameras[k], self.degree, False)
                off, weight = (shown.colour - self._image(k)).abs().mean(dim=-1), self.weights[k].to(torch.float32)
                total += float((off * weight).sum())
                mass += float(weight.sum())
        return total / mass if mass else float("nan")

    # The fit ------------------------------------------------------------------------------------------------------

    @property
    def degree(self) -> int:
        """Of the harmonics, so far."""
        return min(int(self.done / _DEGREE_EVERY + 1e-9), _MAX_DEGREE)

    def fit(self, reporter: Reporter | None = None, kept: Path | None = None) -> None:
        """Phase after phase until the schedule or the time limit ends it. kept: written each minute (:meth:`keep`)."""
        reporter, every, minute = reporter or Reporter(), self.options.tried_every, self.seconds // 60
        number, block = self.now.steps // self.options.phase_steps, int(self.done * _REWARD_BLOCKS)
        while self.done < 1:
            if every and number % every == 0:
                self.controller.phase(self)
            else:
                self.run(self.controller.factors, np.ones(KNOBS))
            number += 1
            if int(self.done * _REWARD_BLOCKS) > block:
                block = int(self.done * _REWARD_BLOCKS)
                self._split_rewards()
            if kept and self.seconds // 60 > minute:
                minute = self.seconds // 60
                self.keep(kept)
            reporter.progress(self.done)

    def step(self, factors: np.ndarray, density: np.ndarray) -> None:
        """One photo: its picture, its loss, a step of Adam, and whatever of the densification is due after it."""
        now, done = self.now, self.done
        if not now.order:
            now.order = [int(k) for k in self.rng.permutation([k for k in self.usable if k not in self.rewards])]
        k = now.order.pop()
        scaled = dict(zip(SCALED, factors, strict=True))
        for group in self.scene.optimiser.param_groups:
            rate = RATES[group["name"]] * scaled.get(group["name"], 1.0)
            group["lr"] = rate * (self.extent_m * _LAST_RATE**done if group["name"] == "means" else 1.0)
        camera, weight = self.photos.cameras[k], self.weights[k].to(torch.float32)
        normals = done >= NORMALS_FROM
        shown = self.scene.render(camera, self.degree, normals)
        loss = photometric(shown.colour, self._image(k), weight)
        if normals:
            loss = loss + NORMALS * depth_normal(shown, unit_rays(camera, weight.device), weight)
        self.scene.optimiser.zero_grad()
        loss.backward()
        for tensor in self.scene.tensors.values():
            if tensor.grad is not None:
                torch.nan_to_num_(tensor.grad, nan=0.0, posinf=0.0, neginf=0.0)
        length = (shown.pull * placed([camera.width / 2, camera.height / 2], shown.pull)).norm(dim=1)
        now.pull += torch.stack([length, (length > 0).to(length.dtype)])
        self.scene.optimiser.step()
        now.losses[now.steps] = loss.detach()
        now.steps += 1
        self._control_density(density)

    def _control_density(self, knobs: np.ndarray) -> None:
        now, rule, done, scene = self.now, self.rule, self.done, self.scene
        # Every photo has to have had its say before Gaussians are judged.
        every = max(round(rule.every * self.planned), len(self.usable) - len(self.rewards))
        rest = now.steps - now.last_reset
        if now.steps - now.last_grown >= every:
            if rule.begin <= done < rule.end:
                room = self.options.max_gaussians - len(scene)
                split, cloned = grow(scene, now.pull, self.extent_m, room, rule, self.generator, *knobs)
                update_filter(scene, self.photos.cameras)
                means = scene.tensors["means"].detach()
                low, high = (torch.as_tensor(side, dtype=torch.float32, device=means.device)
                             for side in (self.box.low, self.box.high))  # fmt: skip
                inside = ((means >= low) & (means <= high)).all(dim=1)
                reset = now.last_reset > 0
                gone = to_prune(scene, inside, self.extent_m, rule, reset, not reset or rest >= rule.rest_steps)
                if bool(gone.all()):
                    raise InputError(
                        "The published pruning left no Gaussian of the scene; give more photos, or a longer "
                        "--time-limit."
                    )
                scene.keep(~gone)
                now.split, now.cloned, now.pruned = now.split + split, now.cloned + cloned, now.pruned + int(gone.sum())
                now.full |= len(scene) >= self.options.max_gaussians
            else:
                update_filter(scene, self.photos.cameras)
            now.pull, now.last_grown = self._no_pull(), now.steps
        if done < rule.end - rule.reset and rest >= max(round(rule.reset * self.planned), 3 * rule.rest_steps):
            scene.fade(rule.reset_to)
            now.last_reset = now.steps

    def _no_pull(self) -> torch.Tensor:
        return torch.zeros((2, len(self.scene)), device=self.scene.device)

    def _split_rewards(self) -> None:
        """Two other photos that the controller is measured on."""
        enough = self.options.tried_every and len(self.usable) >= 6
        self.rewards = sorted(int(k) for k in self.rng.choice(self.usable, 2, replace=False)) if enough else []
        self.now.order = []

    def _image(self, k: int) -> torch.Tensor:
        return self.images[k].to(torch.float32) / 255

    def report(self, first: int) -> SceneReport:
        """What was done. first: Gaussians at the start."""
        now, options = self.now, self.options
        late = options.time_limit_min is not None and now.steps < options.steps
        losses, tenth = now.losses[: max(now.steps, 1)].cpu().numpy().astype(float), max(now.steps // 10, 1)
        return SceneReport(
            photos=len(self.photos),
            factor=options.factor,
            megapixels=round(sum(camera.width * camera.height for camera in self.photos.cameras) / 1e6, 2),
            steps_planned=self.planned,
            steps=now.steps,
            tried=self.tried,
            gaussians_first=first,
            gaussians=len(self.scene),
            full=now.full,
            counts={"split": now.split, "cloned": now.cloned, "pruned": now.pruned},
            phases_tried=self.controller.phases,
            cpu_s=round(self.seconds, 1),
            ended="time limit" if late else "schedule",
            loss=(float(losses[:tenth].mean()), float(losses[-tenth:].mean())),
        )


def _clock(device: str) -> float:
    """Seconds of the CPU, or of the clock where a GPU works."""
    return time.process_time() if device == "cpu" else time.perf_counter()


def plan(seconds_a_step: float, limit_s: float, options: SceneOptions) -> int:
    """Steps that fit into a time limit at this speed of the first steps, the controller's trials counted."""
    each = 1.0
    if options.tried_every:
        # A phase that is tried runs seven times, and is measured on two photos as often.
        runs = 2 * TRIALS
        each += (runs + 2 * (runs + 1) / (3 * options.phase_steps)) / options.tried_every
    return max(min(int(limit_s / (seconds_a_step * _GROWTH * each)), options.steps), 1)


def fit_scene(
    photos: WholePhotos,
    box: Box,
    points: np.ndarray,
    colours: np.ndarray,
    options: SceneOptions | None = None,
    reporter: Reporter | None = None,
    kept: Path | None = None,
) -> tuple[GaussianField, SceneReport]:
    """The published fit of a whole scene.

    Args:
        photos: all of them, undistorted, at full size. box: what is modelled. points, colours: (M, 3) local metres and
            (M, 3) 0..1, of the dense prior. kept: a file that the fit writes each minute, and goes on from where it is
            there.

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
        if kept and kept.exists():
            fit.go_on(kept)
        fit.fit(reporter, kept)
        made = fit.scene.field()
        return made.select(box.contains(made.means.astype(float))), fit.report(first)
    finally:
        torch.set_num_threads(threads)


def _prepared(
    photos: WholePhotos, box: Box, points: np.ndarray, colours: np.ndarray, options: SceneOptions
) -> SceneFit:
    """A fit at the size of photos, and with the number of steps, that the time limit leaves room for."""
    began = _clock(options.device)
    as_scheduled = np.ones(len(SCALED)), np.ones(KNOBS)
    for factor in (options.factor,) if options.factor else FACTORS if options.time_limit_min else (1.0,):
        scene = Scene(points, colours, start_scales(points), options.device)
        fit = SceneFit(scene, photos.scaled(factor), box, replace(options, factor=factor))
        fit.began = began
        if options.time_limit_min is None:
            break
        # A first few steps say how fast this machine is; they are taken back.
        state = fit.save()
        fit.step(*as_scheduled)
        fit.wait()
        start = fit.seconds
        for _ in range(_TRIED_STEPS - 1):
            fit.step(*as_scheduled)
        fit.wait()
        each = (fit.seconds - start) / (_TRIED_STEPS - 1)
        fit.restore(state)
        fit.tried = 0
        fit.planned = plan(each, 60 * options.time_limit_min - fit.seconds, options)
        if fit.planned >= min(MIN_STEPS, options.steps):
            break
    return fit


#: Share of the Gaussians at the start below which those that are left are a warning: a fit makes more of them.
FEW_LEFT = 0.5


@dataclass(frozen=True)
class SceneReport:
    """What a fit did. factor: size of the photos. steps_planned: foreseen; steps: done. tried: steps that the
    controller took back. full: no more were allowed. ended: ``schedule`` or ``time limit``. loss: of the first and the
    last tenth of the steps."""

    photos: int
    factor: float
    megapixels: float
    steps_planned: int
    steps: int
    tried: int
    gaussians_first: int
    gaussians: int
    full: bool
    counts: dict[str, int]
    phases_tried: int
    cpu_s: float
    ended: str
    loss: tuple[float, float]

    def sentence(self) -> str:
        """How far it came, in words."""
        size = "" if self.factor == 1 else f" at {self.factor:g} times their size"
        return (
            f"{self.photos} photos{size}, {self.steps:,} of the published {PUBLISHED_STEPS:,} steps ({self.ended}), "
            f"{self.gaussians_first:,} Gaussians grown to {self.gaussians:,}, {self.cpu_s / 60:.1f} minutes."
        )

    def warnings(self, options: SceneOptions) -> list[str]:
        """A sentence each where the fit was cut short, lost most of the scene, or was not allowed more Gaussians."""
        said = []
        if self.steps < PUBLISHED_STEPS or self.factor < 1:
            minutes = options.time_limit_min
            limit = "" if minutes is None else f" by the time limit of {minutes:g} minutes"
            said.append(
                f"The published fit was cut short{limit}: {self.sentence()} Diameters may be better with a longer "
                "--time-limit."
            )
        if self.gaussians < FEW_LEFT * self.gaussians_first:
            said.append(
                f"Pruning left {self.gaussians:,} of the {self.gaussians_first:,} Gaussians that the published fit "
                "began with, too few to show stems; give a longer --time-limit, or a smaller plot."
            )
        if self.full:
            said.append(
                f"Densification stopped at {options.max_gaussians:,} Gaussians, the most that this run keeps in hand; "
                "the published method has no such limit."
            )
        return said
