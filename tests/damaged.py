"""Files as disks, editors and power cuts leave them."""

from __future__ import annotations

import numpy as np


def damage(text: str, rng: np.random.Generator) -> str:
    """One to four of: a byte changed, a stretch lost, doubled or swapped, a line cut, lines shuffled."""
    for _ in range(rng.integers(1, 5)):
        if len(text) < 4:
            break
        a, b = sorted(rng.integers(0, len(text), 2))
        b = min(b, a + 40)
        match rng.integers(0, 6):
            case 0:
                text = text[:a] + chr(int(rng.integers(1, 256))) + text[a + 1 :]
            case 1:
                text = text[:a] + text[b:]
            case 2:
                text = text[:b] + text[a:]
            case 3:
                text = text[:a] + "".join(rng.permutation(list(text[a:b]))) + text[b:]
            case 4:
                text = text[:b]
            case 5:
                lines = text.splitlines(keepends=True)
                text = "".join(rng.permutation(lines))
    return text
