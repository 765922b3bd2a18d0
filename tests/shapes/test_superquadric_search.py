"""The contact search between superquadrics: it never fails, and what it finds is the direction of least overlap."""

import numpy as np
import pytest

from tests.shapes.pair_search import (
    PAIRS,
    PairSearch,
    overlap_along,
    random_quaternions,
    rotated,
    superquadrics,
    supports,
    take,
)

MILLION = 1_000_000


@pytest.fixture(scope="module")
def search():
    return PairSearch()


def random_pairs(rng, n, largest_exponent, deepest=0.05, kinds=64):
    """Return pairs of bodies at random orientations whose extents along their centres overlap by up to a share of them."""
    exponents = 2 + (largest_exponent - 2) * rng.random((kinds, 2)) ** 2
    exponents[rng.random(kinds) < 0.25] = 2.0
    chosen = rng.integers(kinds, size=2 * n)
    axes = rng.uniform(0.5, 2.0, (kinds, 3))[chosen]
    position = np.zeros((2 * n, 3))
    turned = random_quaternions(rng, 2 * n)
    bodies = superquadrics(axes, exponents[chosen], position, turned)
    along = rng.normal(size=(n, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    i, j = (take(bodies, slice(k, None, 2)) for k in (0, 1))
    reach = ((supports(j, along) - supports(i, -along)) * along).sum(1)
    position[::2] = along * (reach * rng.uniform(1 - deepest, 1.0, n))[:, None]
    return superquadrics(axes, exponents[chosen], position, turned)


def check(found, bodies, rng):
    """Check that every pair is either apart along the direction found, or overlaps least along it; return how many touch."""
    touching = found["touching"]
    along, offset = overlap_along(bodies, found["normal"])
    for name in ("overlap", "radius_i", "lever_i", "lever_j", "normal"):
        assert np.all(np.isfinite(found[name])), name
    assert np.linalg.norm(found["normal"], axis=1) == pytest.approx(np.ones(len(along)), abs=1e-12)
    assert np.all(along[~touching] < 0)  # a direction in which they are apart proves it
    assert found["overlap"][touching] == pytest.approx(along[touching], abs=1e-7)
    least = along.copy()
    for size in (1e-2, 1e-4):
        beside = found["normal"] + size * rng.normal(size=offset.shape)
        beside /= np.linalg.norm(beside, axis=1)[:, None]
        least = np.minimum(least, overlap_along(bodies, beside)[0])
    better = (along - least)[touching]
    return touching, better


def test_a_million_random_orientations_without_a_failed_search(search):
    """Exponents up to 10: every contact found is the direction of least overlap, every other pair is proven apart."""
    rng = np.random.default_rng(0)
    done = touched = rough = 0
    while done < MILLION:
        n = min(PAIRS, MILLION - done)
        bodies = random_pairs(rng, n, 10.0)
        touching, better = check(search(bodies), bodies, rng)
        touched += np.count_nonzero(touching)
        rough += np.count_nonzero(better > 1e-9)
        assert better.max() < 1e-4  # the midway point's normal, where nothing better was found, is right to first order
        done += n
    assert touched > 0.2 * MILLION
    assert rough < 1e-5 * MILLION


def test_nearly_sharp_edges(search):
    """Exponents up to 40."""
    rng = np.random.default_rng(1)
    bodies = random_pairs(rng, PAIRS, 40.0)
    touching, better = check(search(bodies), bodies, rng)
    assert np.count_nonzero(touching) > 0.1 * PAIRS
    assert np.count_nonzero(better > 1e-9) < 1e-3 * PAIRS
    assert better.max() < 0.02


def test_ellipsoids_are_what_any_superquadric_of_exponents_two_is(search):
    rng = np.random.default_rng(2)
    bodies = random_pairs(rng, 2000, 2.0)
    quick, careful = search(bodies), search(bodies, general=True)
    assert np.array_equal(quick["touching"], careful["touching"])
    both = quick["touching"]
    assert np.count_nonzero(both) > 400
    for name in ("overlap", "normal", "lever_i", "lever_j", "radius_i", "radius_j"):
        close = 1e-4 if name.startswith("radius") else 1e-6  # taken one small step before the end
        assert careful[name][both] == pytest.approx(quick[name][both], abs=close), name


def test_the_last_normal_is_as_good_a_start_as_none(search):
    rng = np.random.default_rng(3)
    bodies = random_pairs(rng, 2000, 8.0)
    cold = search(bodies)
    start = cold["normal"] + 0.02 * rng.normal(size=(2000, 3))
    warm = search(bodies, start=start / np.linalg.norm(start, axis=1)[:, None])
    both = cold["touching"]
    assert np.array_equal(warm["touching"], both)
    assert warm["overlap"][both] == pytest.approx(cold["overlap"][both], abs=1e-7)


def test_support_points_of_ellipsoids_face_each_other(search):
    """At the normal found the two support points, A n/√(n·A n) each, lie on one line along it, a contact point between them."""
    rng = np.random.default_rng(4)
    bodies = random_pairs(rng, 2000, 2.0)
    found = search(bodies)
    touching = found["touching"]
    along, offset = overlap_along(bodies, found["normal"])
    across = (offset + along[:, None] * found["normal"])[touching]
    assert np.linalg.norm(across, axis=1).max() < 1e-6
    i, j = (take(bodies, slice(k, None, 2)) for k in (0, 1))
    middle = i.position + 0.5 * (
        supports(i, -found["normal"]) + supports(j, found["normal"]) - (i.position - j.position)
    )
    assert (i.position + found["lever_i"])[touching] == pytest.approx(middle[touching], abs=1e-6)
    assert (j.position + found["lever_j"])[touching] == pytest.approx(middle[touching], abs=1e-6)


@pytest.mark.parametrize(
    ("apart", "first", "second", "overlap"),
    [
        ((3.99, 0, 0), (1.0, 0, 0, 0), (1.0, 0, 0, 0), 0.01),  # tip to tip
        ((2.99, 0, 0), (1.0, 0, 0, 0), (0.5**0.5, 0, 0, 0.5**0.5), 0.01),  # tip to side
        ((1.99, 0, 0), (0.5**0.5, 0, 0, 0.5**0.5), (0.5**0.5, 0, 0.5**0.5, 0), 0.01),  # side to side
        ((1.99, 0, 0), (0.5**0.5, 0, 0, 0.5**0.5), (0.5**0.5, 0, 0, 0.5**0.5), 0.01),
    ],
)
def test_ellipsoids_in_line(search, apart, first, second, overlap):
    """Semi-axes 2, 1, 1 at 3.99, 2.99 and 1.99, turned; a hundredth further they are apart."""
    axes, exponents = np.tile([2.0, 1, 1], (2, 1)), np.full((2, 2), 2.0)
    for shift, touches in ((0.0, True), (0.02, False)):
        position = np.array([np.add(apart, (shift, 0, 0)), (0, 0, 0)], float)
        found = search(superquadrics(axes, exponents, position, np.array([first, second], float)))
        assert found["touching"][0] == touches
        if touches:
            assert found["overlap"][0] == pytest.approx(overlap, abs=1e-12)
            assert found["normal"][0] == pytest.approx([1, 0, 0], abs=1e-9)


def test_gaps_within_reach_are_found(search):
    rng = np.random.default_rng(5)
    bodies = random_pairs(rng, 2000, 2.0)
    near, far = search(bodies, reach=0.3), search(bodies)
    assert np.count_nonzero(near["touching"]) > np.count_nonzero(far["touching"])
    gaps = near["touching"] & ~far["touching"]
    assert np.all(near["overlap"][gaps] < 0)
    along, _ = overlap_along(bodies, near["normal"])
    assert near["overlap"][gaps] == pytest.approx(along[gaps], abs=1e-9)


def meets(bodies):
    """Return Perram and Wertheim's function of pairs of ellipsoids.

    F = max over λ of λ (1 − λ) rᵀ ((1 − λ) A_i + λ A_j)⁻¹ r is below 1 exactly where they overlap.
    Source: Perram & Wertheim (1985), doi 10.1016/0021-9991(85)90171-8.
    """
    spread = []
    for k in (0, 1):
        body = take(bodies, slice(k, None, 2))
        frame = np.stack([rotated(body.orientation, np.tile(e, (len(body), 1))) for e in np.eye(3)], axis=-1)
        spread.append(np.einsum("nik,nk,njk->nij", frame, body.element_axes**2, frame))
    apart = bodies.position[::2] - bodies.position[1::2]
    best = np.zeros(len(apart))
    for weight in np.linspace(0.0, 1.0, 401)[1:-1]:
        mixed = (1 - weight) * spread[0] + weight * spread[1]
        best = np.maximum(
            best, weight * (1 - weight) * (apart * np.linalg.solve(mixed, apart[..., None])[..., 0]).sum(1)
        )
    return best


@pytest.mark.parametrize("ratio", [1.5, 3.0, 5.0, 8.0, 0.5, 0.2, 0.125])
def test_slender_and_flat_ellipsoids_touch_only_where_they_meet(search, ratio):
    """From the line of centres, which says little about them: no contact of bodies that are apart, none missed."""
    rng = np.random.default_rng(6)
    n = 4000
    axes = np.tile([1.0, 1.0, ratio], (2 * n, 1)) * rng.uniform(0.8, 1.2, (2 * n, 1))
    turned = random_quaternions(rng, 2 * n)
    position = np.zeros((2 * n, 3))
    along = rng.normal(size=(n, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    position[::2] = along * rng.uniform(0.3, 2.4, (n, 1)) * max(1.0, ratio)
    bodies = superquadrics(axes, np.full((2 * n, 2), 2.0), position, turned)
    truth, found = meets(bodies), search(bodies)
    clear = np.abs(truth - 1) > 0.01  # the grid of weights leaves the rest undecided
    assert np.array_equal(found["touching"][clear], truth[clear] < 1)
    shallow = np.flatnonzero(found["touching"] & (truth > 0.9))
    assert len(shallow) > 20
    pairs = take(bodies, np.column_stack([2 * shallow, 2 * shallow + 1]).ravel())
    for _ in range(1000):  # no direction is known in which they overlap less
        tried = rng.normal(size=(len(shallow), 3))
        tried /= np.linalg.norm(tried, axis=1)[:, None]
        assert np.all(found["overlap"][shallow] <= overlap_along(pairs, tried)[0] + 1e-9)
