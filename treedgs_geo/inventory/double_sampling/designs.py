"""Which trees to tape: in strata by flag and DBH, simple random sampling in each (Cochran 1977, Sampling Techniques,
ch. 5), so that every tree's inclusion probability is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.errors import InputError

#: What a tree of each flag weighs when tapes are shared out among strata: the errors of trees that are marked ``check``
#: are larger, and one without a DBH may be a tree of any diameter, or none. Chosen, not set on data.
FLAG_WEIGHT = {"ok": 1.0, "check": 2.0, "reject": 2.0}
#: Tapes of a stratum: with fewer its spread is not known; and how many a further DBH stratum has to have.
FEWEST, PER_CLASS = 2, 4
#: More strata by DBH than this gain little (Cochran 1977, 5A.8).
MAX_CLASSES = 5


@dataclass(frozen=True)
class Draw:
    """index: (n,) positions of the drawn trees in the frame, ascending. prob: (n,) their inclusion probabilities.

    stratum: (n,) names of their strata.
    """

    index: np.ndarray
    prob: np.ndarray
    stratum: np.ndarray


def draw_trees(size: np.ndarray, flag: np.ndarray, n: int, seed: int) -> Draw:
    """Draw ``n`` of the N trees of a frame.

    size: (N,) basal area or what stands for it, above 0. flag: (N,) ``ok``, ``check`` or ``reject``. The same seed and
    frame draw the same trees.

    Raises:
        InputError: an empty frame, or fewer than two tapes (of one tape no error can be known).
    """
    size, flag = np.asarray(size, float), np.asarray(flag, object)
    if not len(size):
        raise InputError("There is no tree to draw from: the tree layer is empty, or none of its trees is in a plot.")
    if n < FEWEST:
        raise InputError(f"--n: found {n}, expected at least {FEWEST} tapes (of one tape no error can be known).")
    rng = np.random.default_rng(seed)
    if n >= len(size):
        return Draw(np.arange(len(size)), np.ones(len(size)), np.full(len(size), "all", object))
    names = strata(size, flag, n)
    index, prob = [], []
    for name, count in allocate(names, size, flag, n).items():
        members = np.flatnonzero(names == name)
        index.append(rng.choice(members, count, replace=False))
        prob.append(np.full(count, count / len(members)))
    order = np.argsort(np.concatenate(index))
    chosen = np.concatenate(index)[order]
    return Draw(chosen, np.concatenate(prob)[order], names[chosen])


def strata(size: np.ndarray, flag: np.ndarray, n: int) -> np.ndarray:
    """(N,) names: ``no DBH``, ``check``, and ``ok`` in DBH classes of equal aggregate size (``ok 1`` the thinnest).

    With equal aggregates about equal numbers of tapes are best (Cochran 1977, 5A.8). As many classes as ``n`` allows
    with :data:`PER_CLASS` tapes each; where two small groups would take half of the tapes they are one.
    """
    names = np.array([{"check": "check", "reject": "no DBH"}.get(value, "ok") for value in flag], object)
    groups = [name for name in ("check", "no DBH") if (names == name).any()]
    if len(groups) == 2 and n < 4 * FEWEST + PER_CLASS:
        names[names != "ok"] = "check or no DBH"
        groups = ["check or no DBH"]
    ok = np.flatnonzero(names == "ok")
    if n < FEWEST * (len(groups) + 1) or not len(ok):
        names[:] = names if not len(ok) else "all"
        return names
    spent = sum(min(FEWEST, int((names == name).sum())) for name in groups)
    k = int(np.clip((n - spent) // PER_CLASS, 1, MAX_CLASSES))
    k = max(min(k, len(ok) // FEWEST), 1)
    order = ok[np.argsort(size[ok], kind="stable")]
    before = np.cumsum(size[order]) - size[order] / 2
    number = np.minimum((before / size[ok].sum() * k).astype(int), k - 1)
    # A class of fewer trees than tapes are needed joins its neighbour.
    while k > 1 and np.bincount(number, minlength=k).min() < FEWEST:
        low = int(np.argmin(np.bincount(number, minlength=k)))
        number[number > max(low - 1, 0)] -= 1
        k -= 1
    names[order] = [f"ok {value + 1}" if k > 1 else "ok" for value in number]
    return names


def allocate(names: np.ndarray, size: np.ndarray, flag: np.ndarray, n: int) -> dict[str, int]:
    """Stratum -> tapes: :data:`FEWEST` each (all of a smaller one), the rest by aggregate size and flag's weight."""
    worth = np.asarray(size, float) * np.array([FLAG_WEIGHT.get(value, 1.0) for value in flag])
    keys = sorted(set(names))
    many = {key: int((names == key).sum()) for key in keys}
    found = {key: min(FEWEST, many[key]) for key in keys}
    for _ in range(n - sum(found.values())):
        # One tape after the other to the stratum that is furthest below its share.
        free = [key for key in keys if found[key] < many[key]]
        if not free:
            break
        best = max(free, key=lambda key: worth[names == key].sum() / (found[key] + 0.5))
        found[best] += 1
    return found
