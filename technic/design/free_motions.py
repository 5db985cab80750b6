"""Everything that costs nothing in a model, as one sparse basis."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from technic.rigidity.kinematics import Kinematics, component_motions

__all__ = ["all_motions"]


def all_motions(kin: Kinematics) -> sparse.csc_array:
    """Return all motions, rigid ones of each piece included, as scaled twists (6 parts, k).

    Twists are those of `Kinematics`: about each part's centroid, world axes, translations divided by
    its length. Columns come piece by piece.
    """
    rows, columns, values, first = [], [], [], 0
    for component in range(len(kin.components)):
        motions = component_motions(kin, component)
        own = np.concatenate([np.arange(6 * p, 6 * p + 6) for p in motions.parts])
        found = sparse.coo_array(motions.twists)
        rows.append(own[found.coords[0]])
        columns.append(first + found.coords[1])
        values.append(found.data)
        first += motions.twists.shape[1]
    shape = (6 * len(kin.assembly.parts), first)
    if not rows:
        return sparse.csc_array(shape)
    place = (np.concatenate(rows), np.concatenate(columns))
    return sparse.csc_array((np.concatenate(values), place), shape=shape)
