"""What a species entry means: PLANTS symbol, FIA number, scientific or common name, from one table."""

from __future__ import annotations

import csv
import difflib
import functools
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files

#: How a tree without a species is named in every table.
UNKNOWN = "unknown"


@dataclass(frozen=True)
class Species:
    """symbol: PLANTS symbol, or the entry itself when it is in no list. fia: FIA number, '' where there is none. group:
    biomass group of Jenkins et al. 2003, '' when not known."""

    symbol: str
    fia: str = ""
    scientific: str = ""
    common: str = ""
    group: str = ""

    @property
    def label(self) -> str:
        """For tables: the common name where there is one."""
        return self.common or self.symbol


@functools.lru_cache(maxsize=1)
def _known() -> dict[str, Species]:
    """Every accepted spelling (upper case) -> species."""
    text = (files(__package__) / "data" / "species.csv").read_text(encoding="utf-8")
    found: dict[str, Species] = {}
    for row in csv.DictReader(text.splitlines()):
        made = Species(row["symbol"], row["fia"], row["scientific"], row["common"], row["biomass_group"])
        for name in (made.symbol, made.fia, made.scientific, made.common):
            if name:
                found.setdefault(name.upper(), made)
    return found


@functools.lru_cache(maxsize=4096)
def species_of(entry: str | None) -> Species:
    """The species behind an entry such as ``PITA``, ``131``, ``Pinus taeda`` or ``loblolly pine``.

    An entry in no list stays as it is (its own symbol, no group); none at all is :data:`UNKNOWN`.
    """
    text = "" if entry is None else " ".join(str(entry).split())
    if text.endswith(".0") and text[:-2].isdigit():
        text = text[:-2]
    if not text or text.lower() in ("nan", "none", "<na>", UNKNOWN):
        return Species(UNKNOWN)
    return _known().get(text.upper(), Species(text))


def nearest(entry: str) -> str:
    """``; nearest known: PITA (loblolly pine), PIVI2 (Virginia pine)``; empty where nothing is alike."""
    known = _known()
    alike = difflib.get_close_matches(str(entry).strip().upper(), known, n=3, cutoff=0.6)
    found = list(dict.fromkeys(f"{known[name].symbol} ({known[name].common})" for name in alike))[:2]
    return f"; nearest known: {', '.join(found)}" if found else ""


def unknown_sentences(entries: Iterable[str | None], own: Iterable[str] = ()) -> list[str]:
    """Each species entry that is in no list, with its number of trees and the nearest known ones.

    own: symbols that the user's own equations name; they are known too.
    """
    listed = {UNKNOWN.upper(), *_known(), *(species_of(name).symbol.upper() for name in own)}
    symbols = (species_of(entry).symbol for entry in entries)
    odd = Counter(symbol for symbol in symbols if symbol.upper() not in listed)
    found = [
        f"Species {symbol!r} of {n} tree{'' if n == 1 else 's'} is in no list (PLANTS symbol, FIA number, scientific "
        f"or common name){nearest(symbol)}; correct it, or give equations for it with --equations."
        for symbol, n in odd.most_common(6)
    ]
    if len(odd) > 6:
        found.append(f"{len(odd) - 6} more species entries are in no list.")
    return found
