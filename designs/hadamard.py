"""Orthogonal ±1 matrices and conference matrices, from cyclic rows and from squares in finite fields."""

from __future__ import annotations

import functools

import numpy as np

from designs.space import Array

#: First rows of the cyclic designs printed by Plackett & Burman, Biometrika 33 (1946) 305,
#: doi 10.1093/biomet/33.4.305.
_CYCLIC = {
    8: "+++-+--",
    12: "++-+++---+-",
    16: "++++-+-++--+---",
    20: "++--++++-+-+----++-",
    24: "+++++-+-++--++--+-+----",
    32: "----+-+-+++-++---+++++--++-+--+",
    36: "-+-+++---+++++-+++--+----+-+-++--+-",
}

#: Every multiple of four up to 100 but 92, which needs a construction nobody has asked for yet.
HADAMARD_ORDERS = tuple(n for n in range(4, 101, 4) if n != 92)


@functools.lru_cache(maxsize=8)
def plackett_burman_columns(n: int) -> Array:
    """Return n − 1 orthogonal ±1 columns, shape (n, n − 1), the last run all −1.

    Raises:
        ValueError: for an order that is not in ``HADAMARD_ORDERS``.
    """
    if n in _CYCLIC:
        row = np.array([1.0 if sign == "+" else -1.0 for sign in _CYCLIC[n]])
        columns = np.vstack([np.roll(row, shift) for shift in range(n - 1)] + [-np.ones(n - 1)])
    else:
        matrix = _hadamard(n)
        matrix = matrix * matrix[:, :1]  # first column all +1: the mean
        columns = matrix[:, 1:] * -matrix[-1, 1:]
    columns.setflags(write=False)
    return columns


def _hadamard(n: int) -> Array:
    if n == 1:
        return np.ones((1, 1))
    if n == 2:
        return np.array([[1.0, 1.0], [1.0, -1.0]])
    if _prime_power(n - 1) and (n - 1) % 4 == 3:  # Paley I
        return conference_matrix(n) + np.eye(n)
    half = n // 2
    if n % 4 == 0 and half % 2 == 0 and _prime_power(half - 1) and (half - 1) % 4 == 1:  # Paley II
        conference = conference_matrix(half)
        plus, minus = conference + np.eye(half), conference - np.eye(half)
        return np.block([[plus, minus], [minus, -plus]])
    if n % 8 == 0:  # Sylvester's doubling
        inner = _hadamard(half)
        return np.kron(np.array([[1.0, 1.0], [1.0, -1.0]]), inner)
    raise ValueError(f"No construction here gives a Hadamard matrix of order {n}.")


@functools.lru_cache(maxsize=8)
def conference_matrix(m: int) -> Array:
    """Return C of shape (m, m) with zero diagonal, ±1 elsewhere and CᵀC = (m − 1) I.

    Paley's construction where m − 1 is a prime power, doubling of a skew one where m/2 has that.
    Source: Paley, J. Math. Phys. 12 (1933) 311, doi 10.1002/sapm1933121311.

    Raises:
        ValueError: for orders that have no conference matrix (22, 34 …) or none by these constructions.
    """
    q = m - 1
    if _prime_power(q):
        symmetric = q % 4 == 1
        jacobsthal = _jacobsthal(q)
        top = np.ones((1, q))
        matrix = np.block([[np.zeros((1, 1)), top], [top.T if symmetric else -top.T, jacobsthal]])
    elif m % 4 == 0 and _prime_power(m // 2 - 1) and (m // 2 - 1) % 4 == 3:
        skew, one = conference_matrix(m // 2), np.eye(m // 2)
        matrix = np.block([[skew, skew + one], [skew - one, -skew]])
    else:
        raise ValueError(f"No construction here gives a conference matrix of order {m}.")
    if not np.array_equal(matrix.T @ matrix, (m - 1) * np.eye(m)):
        raise ValueError(f"The conference matrix of order {m} is not orthogonal.")
    return matrix


def has_conference_matrix(m: int) -> bool:
    """Return whether ``conference_matrix`` can make order m."""
    half = m // 2 - 1
    return m % 2 == 0 and (_prime_power(m - 1) or (m % 4 == 0 and _prime_power(half) and half % 4 == 3))


def _jacobsthal(q: int) -> Array:
    """Return Q with Q[i, j] = χ(aᵢ − aⱼ) over the field of q elements; χ is +1 on squares, −1 otherwise, χ(0) = 0."""
    field = _Field(q)
    squares = {field.times(a, a) for a in range(1, q)}
    character = np.array([0.0] + [1.0 if a in squares else -1.0 for a in range(1, q)])
    return np.array([[character[field.minus(a, b)] for b in range(q)] for a in range(q)])


class _Field:
    """The finite field of q = p^e elements, each written as the number whose base-p digits are its coefficients."""

    def __init__(self, q: int) -> None:
        self.p, self.e = _prime_and_exponent(q)
        self.modulus = self._irreducible() if self.e > 1 else []

    def minus(self, a: int, b: int) -> int:
        """Return a − b."""
        return self._number([(x - y) % self.p for x, y in zip(self._digits(a), self._digits(b), strict=True)])

    def times(self, a: int, b: int) -> int:
        """Return a · b."""
        product = [0] * (2 * self.e - 1)
        for i, x in enumerate(self._digits(a)):
            for j, y in enumerate(self._digits(b)):
                product[i + j] += x * y
        for i in range(len(product) - 1, self.e - 1, -1):  # x^e = −(lower coefficients of the modulus)
            for j, coefficient in enumerate(self.modulus):
                product[i - self.e + j] -= product[i] * coefficient
        return self._number([value % self.p for value in product[: self.e]])

    def _irreducible(self) -> list[int]:
        """Return the lower coefficients of a monic polynomial without roots; for e = 2, 3 that is irreducible."""
        for number in range(self.p**self.e):
            digits = self._digits(number)
            roots = (sum(d * x**i for i, d in enumerate([*digits, 1])) % self.p == 0 for x in range(self.p))
            if not any(roots):
                return digits
        raise ValueError(f"No irreducible polynomial of degree {self.e} over {self.p}.")

    def _digits(self, number: int) -> list[int]:
        return [number // self.p**i % self.p for i in range(self.e)]

    def _number(self, digits: list[int]) -> int:
        return sum(digit * self.p**i for i, digit in enumerate(digits))


def _prime_and_exponent(q: int) -> tuple[int, int]:
    p = next(d for d in range(2, q + 1) if q % d == 0)
    e = 0
    while q % p == 0:
        q, e = q // p, e + 1
    return (p, e) if q == 1 else (0, 0)


def _prime_power(q: int) -> bool:
    """Return whether q is an odd prime to the power 1, 2 or 3 (the fields built here)."""
    return q > 2 and q % 2 == 1 and 1 <= _prime_and_exponent(q)[1] <= 3
