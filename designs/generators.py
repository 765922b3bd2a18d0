"""Generators of regular two-level fractions: words, resolution, and where the good ones are."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence

import numpy as np
import pyDOE3

from designs.errors import DesignError
from designs.space import Array

#: Letters of the factors; I is left out because it stands for the identity column.
LETTERS = "ABCDEFGHJKLMNOPQRSTUVWXYZ"

#: Minimum-aberration fractions, (factors, added generators): words of the added columns.
#: Source: Box, Hunter & Hunter (2005), table 6.22; NIST/SEMATECH e-Handbook, section 5.3.3.4.7,
#: https://doi.org/10.18434/M32189. The tests recompute the resolution of each.
_TABLE: dict[tuple[int, int], tuple[str, ...]] = {
    (5, 2): ("AB", "AC"),
    (6, 2): ("ABC", "BCD"),
    (6, 3): ("AB", "AC", "BC"),
    (7, 2): ("ABCD", "ABDE"),
    (7, 3): ("ABC", "BCD", "ACD"),
    (7, 4): ("AB", "AC", "BC", "ABC"),
    (8, 2): ("ABCD", "ABEF"),
    (8, 3): ("ABC", "ABD", "BCDE"),
    (8, 4): ("BCD", "ACD", "ABC", "ABD"),
    (9, 2): ("ACDFG", "BCEFG"),
    (9, 3): ("ABCD", "ACEF", "CDEF"),
    (9, 4): ("BCDE", "ACDE", "ABDE", "ABCE"),
    (9, 5): ("ABC", "BCD", "ACD", "ABD", "ABCD"),
    (10, 3): ("ABCG", "BCDE", "ACDF"),
    (10, 4): ("BCDF", "ACDF", "ABDE", "ABCE"),
    (10, 5): ("ABCD", "ABCE", "ABDE", "ACDE", "BCDE"),
    (10, 6): ("ABC", "BCD", "ACD", "ABD", "ABCD", "AB"),
}


def fraction(n_factors: int, words: Sequence[str]) -> Array:
    """Return the ±1 columns, shape (2^(k−p), k): a full factorial, then one product column per signed word."""
    base = n_factors - len(words)
    expression = " ".join([*LETTERS[:base].lower(), *(word.lower() for word in words)])
    return np.asarray(pyDOE3.fracfact(expression), dtype=float)


def resolution_of(n_factors: int, words: Sequence[str]) -> int:
    """Return the length of the shortest word of the defining relation (0 for a full factorial)."""
    base = n_factors - len(words)
    defining = [_bits(word) | 1 << (base + i) for i, word in enumerate(words)]
    lengths = [
        bin(functools.reduce(int.__xor__, chosen)).count("1")
        for size in range(1, len(defining) + 1)
        for chosen in itertools.combinations(defining, size)
    ]
    return min(lengths, default=0)


def generators_for(n_factors: int, n_added: int) -> tuple[str, ...] | None:
    """Return the words of the best known fraction of 2^(k − added) runs, or None when there is none."""
    base = n_factors - n_added
    if n_added == 0:
        return ()
    if n_factors > 2**base - 1 or base < 2:
        return None
    if n_added == 1:
        return (LETTERS[:base],)
    if (n_factors, n_added) in _TABLE:
        return _TABLE[n_factors, n_added]
    for resolution in (6, 5, 4, 3):
        words = _search(base, n_added, resolution)
        if words is not None:
            return words
    return None


def _search(base: int, n_added: int, resolution: int) -> tuple[str, ...] | None:
    """Add words greedily, longest first, each clear of all products of fewer than ``resolution`` − 1 columns."""
    columns = [1 << i for i in range(base)]
    candidates = sorted(range(1, 2**base), key=lambda bits: (-bin(bits).count("1"), bits))
    if resolution == 4:  # all odd words together have resolution IV and hold the most factors
        candidates = [bits for bits in candidates if bin(bits).count("1") % 2]
    chosen: list[int] = []
    taken = _products(columns, resolution - 2)
    for bits in candidates:
        if len(chosen) == n_added:
            break
        if bits not in taken:
            chosen.append(bits)
            taken = _products([*columns, *chosen], resolution - 2)
    return tuple(_word(bits) for bits in chosen) if len(chosen) == n_added else None


def _products(columns: Sequence[int], most: int) -> set[int]:
    return {
        functools.reduce(int.__xor__, chosen)
        for size in range(1, most + 1)
        for chosen in itertools.combinations(columns, size)
    }


def parse_generators(text: str, n_factors: int) -> tuple[tuple[str, ...], Array]:
    """Return the words and signs of generators written as ``D=ABC, E=-AB`` (or just ``ABC, -AB``).

    Raises:
        DesignError: for letters that are not base factors, or left-hand sides that are not the added factors in order.
    """
    parts = [part for part in text.replace(";", ",").replace(" ", "").split(",") if part]
    base = n_factors - len(parts)
    allowed = LETTERS[: max(base, 0)]
    words, signs = [], []
    for i, part in enumerate(parts):
        left, _, right = part.upper().rpartition("=")
        sign, word = (-1.0, right[1:]) if right[:1] in "-−" and right else (1.0, right.lstrip("+"))
        expected = LETTERS[base + i]
        if left not in ("", expected) or not word or set(word) - set(allowed) or len(set(word)) < len(word):
            raise DesignError(
                f"Generator {part!r} can't be used. {n_factors} factors with {len(parts)} generators have base "
                f"factors {', '.join(allowed) or 'none'}; write {expected}= and a product of these, once each, "
                f"such as {expected}={allowed}."
            )
        words.append("".join(sorted(word)))
        signs.append(sign)
    return tuple(words), np.array(signs)


def fractions(n_factors: int) -> Iterator[tuple[int, int, tuple[str, ...]]]:
    """Yield (runs, resolution, words) of the best known fractions from fewest to most runs."""
    for n_added in range(n_factors - 2, -1, -1):
        words = generators_for(n_factors, n_added)
        if words is not None:
            yield 2 ** (n_factors - n_added), resolution_of(n_factors, words), words


def _bits(word: str) -> int:
    return sum(1 << LETTERS.index(letter) for letter in word)


def _word(bits: int) -> str:
    return "".join(letter for i, letter in enumerate(LETTERS) if bits >> i & 1)
