"""An analytic simulator that is anything but linear, and studies of materials whose truth is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import qmc

from analysis.missing_effect.kernel import Points
from analysis.missing_effect.problem import Candidate, Parameter, Problem
from analysis.missing_effect.search import Search, search
from analysis.missing_effect.surrogate import Surrogate

P, K = 4, 6
CONFERENCE = np.array([[0, 1, 1, 1], [1, 0, 1, -1], [1, -1, 0, 1], [1, 1, -1, 0]])
U_DIRECT = 0.1  # of parameters that are measured directly
ROWS = 4  # of the design per effect


@dataclass(frozen=True)
class Kind:
    """What is measured, and how well.

    Attributes:
        responses: their number; of the first eight two belong to one test.
        direct: how many of the four parameters are measured directly.
        u: standard uncertainty of a measurement.
        noise: scatter of the simulator from seed to seed.
        imitated: True if a parameter does nearly what the third effect does, as sliding friction does in a heap.
    """

    responses: int = 11
    direct: int = 2
    u: float = 0.5
    noise: float = 0.7
    imitated: bool = False


BENCH, BULK, NOISY = Kind(), Kind(responses=5, direct=0, imitated=True), Kind(u=6.0, noise=3.0)
OUTSIDE = "outside"  # what acts is none of the six effects


class Toy:
    """S = 20 + J x + x Q x + Σ_k (E_k + I_k x) g(β_k), g(β) = β/(0.6 + 0.4 |β|), and its surrogate from a screening design.

    The first two effects look alike. All numbers are drawn anew for every seed.
    """

    def __init__(self, seed: int, kind: Kind = BENCH) -> None:
        rng, m = np.random.default_rng(seed), kind.responses
        self.kind = kind
        self.slope, self.bend = 2 * rng.normal(size=(m, P)), 0.3 * rng.normal(size=(m, P, P))
        self.effects, self.mixed = 4 * rng.normal(size=(m, K)), 0.6 * rng.normal(size=(m, K, P))
        self.effects[:, 1] = self.effects[:, 0] + 0.5 * rng.normal(size=m)
        if kind.imitated:
            self.effects[:, 2] = self.slope @ [1.5, -0.7, 0.5, 0.3]
        self.outside = 4 * rng.normal(size=m)
        self.labels = tuple(f"r{i}" for i in range(m))
        self.tests = tuple(f"t{i // 2 if i < 8 else i - 4}" for i in range(m))
        self.points = screening()
        clean = np.array([self.simulate(x, b) for x, b in zip(self.points.x, self.points.share, strict=True)])
        self.runs = clean + rng.normal(0, kind.noise, clean.shape)
        self.surrogate = Surrogate(self.points, self.runs, self.labels)

    def simulate(self, x: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Return the responses at a point, without scatter."""
        acting = share / (0.6 + 0.4 * np.abs(share))
        base = 20 + self.slope @ x + np.einsum("mjk,j,k->m", self.bend, x, x)
        return base + self.effects @ acting + np.einsum("mkj,k,j->m", self.mixed, acting, x)

    def problem(self, truth: tuple[int, ...] | str, strength: float, seed: int) -> Problem:
        """Return measurements of a material with other parameters than anyone believes, and with some effects in."""
        rng, share = np.random.default_rng(seed), np.zeros(K)
        x = rng.uniform(-0.6, 0.6, P)
        if truth != OUTSIDE:
            share[list(truth)] = strength
        measured = self.simulate(x, share) + rng.normal(0, self.kind.u, self.kind.responses)
        if truth == OUTSIDE:
            measured = measured + self.outside * strength / (0.6 + 0.4 * strength)
        read = x + rng.normal(0, U_DIRECT, P)
        parameters = tuple(
            Parameter(f"p{j}", -1, 1, 0.0, *((read[j], U_DIRECT) if j < self.kind.direct else (None, None)))
            for j in range(P)
        )
        u = np.full(self.kind.responses, self.kind.u)
        return Problem(self.labels, self.tests, measured, u, parameters, tuple(Candidate(f"e{k}") for k in range(K)))

    def search(self, truth: tuple[int, ...] | str, strength: float, seed: int) -> Search:
        """Return what the measurements of such a material say."""
        return search(self.problem(truth, strength, seed), self.surrogate, draws=500)

    def table(self) -> pd.DataFrame:
        """Return the runs as a table for the analyser."""
        acting = self.points.share.argmax(axis=1)
        share = self.points.share.max(axis=1)
        table = pd.DataFrame(self.points.x, columns=[f"p{j}" for j in range(P)])
        table = table.assign(effect=np.where(share > 0, [f"e{k}" for k in acting], ""), share=share)
        return table.join(pd.DataFrame(self.runs, columns=self.labels))


def screening() -> Points:
    """Return centre points, definitive screening and a Latin hypercube without effects, and a hypercube for each effect."""
    hypercube = [2 * qmc.LatinHypercube(P, rng=1).random(3 * P) - 1]
    x = [np.zeros((4, P)), CONFERENCE, -CONFERENCE, *hypercube]
    share = [np.zeros((sum(map(len, x)), K))]
    for k in range(K):
        x.append(2 * qmc.LatinHypercube(P, rng=k + 5).random(ROWS) - 1)
        strengths = np.random.default_rng(k).permutation(np.linspace(0.25, 1.0, ROWS))
        share.append(np.outer(strengths, np.eye(K)[k]))
    return Points(np.vstack(x), np.vstack(share))
