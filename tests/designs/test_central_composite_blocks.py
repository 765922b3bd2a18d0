"""Central composite designs in three blocks keep their whole cube, whatever their kind."""

import numpy as np
import pytest

from designs import CentralComposite, Factor, FactorSpace


@pytest.mark.parametrize("kind", ["circumscribed", "inscribed", "face_centred"])
@pytest.mark.parametrize("factors", [3, 4])
def test_three_blocks_hold_both_halves_of_the_cube(kind, factors):
    space = FactorSpace([Factor(name, 0.0, 1.0) for name in "abcd"[:factors]])
    made = CentralComposite(kind=kind, blocks=3).generate(space, seed=1)
    cube = made.coded[(made.table["point_type"] == "factorial").to_numpy()]
    assert len(cube) == 2**factors
    assert len(np.unique(np.sign(np.asarray(cube, float)[:, :factors]), axis=0)) == 2**factors
    blocks = made.table.loc[made.table["point_type"] == "factorial", "block"]
    assert sorted(blocks.value_counts().tolist()) == [2 ** (factors - 1)] * 2
