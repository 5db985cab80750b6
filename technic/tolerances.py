"""Every tolerance of the program, in one place, each with the reason for its value.

Lengths are in metres, angles in radians, unless the name says otherwise. The figures in the reasons
were measured on about a hundred public models (10,934 pin and axle pairs).
"""

from __future__ import annotations

from math import radians
from typing import Final

from technic.units import LDU, PITCH

# --- connections ------------------------------------------------------------------------------
RADIAL_OFFSET: Final = 4.5 * LDU
"""Two features mate when their lines are at most this far apart. Hand-placed models are off by up
to 4.1 LDU in places; on clean files every limit from 0.5 to 7 LDU gives the same joints."""

REPORTED_OFFSET: Final = 1.0 * LDU
"""A joint further off than this is listed as "placed off by x"; 99.65 % of real joints are closer."""

ANGLE: Final = radians(5.0)
"""Two features mate when their axes differ by at most this. Limits from 1 to 10 degrees give the
same joints on real models; 99.95 % are within 0.5 degrees."""

AXIAL_OVERLAP: Final = 4.0 * LDU
"""Least common length of two mating features (or `SHORT_FEATURE_SHARE` of the shorter one)."""

SHORT_FEATURE_SHARE: Final = 0.75
"""Features shorter than `AXIAL_OVERLAP` mate when they share this part of the shorter length."""

STUD_OFFSET: Final = 2.0 * LDU
"""A stud sits in a tube or beside it, 10 or 14.14 LDU from its middle; this far off at most, half of
what separates the two."""

TOUCH: Final = 1.0 * LDU
"""Two parts on one axle touch when the gap between them is at most this."""

COUNTERBORE: Final = 2.0 * LDU
"""Depth of a pin hole's counterbore: a collar may sit this far inside the hole it stops at."""

NEAR_MISS: Final = 10.0 * LDU
"""A pin end and a hole whose lines are further apart than `RADIAL_OFFSET` but not more than this (half
a pitch, beyond which another hole would be as near) miss each other narrowly."""

NEAR_MISS_ANGLE: Final = radians(15.0)
"""The same for the angle between them: three times `ANGLE`, less than any angle that a builder means
(the flattest bent beam turns by 36.87 degrees)."""

# --- file input -------------------------------------------------------------------------------
ROTATION_WARNING: Final = 1e-2
"""A rotation matrix further from orthonormal than this is warned about (most are within 1e-6; a few
real files reach 0.05) and projected to the nearest rotation."""

ROTATION_SCALED: Final = 0.1
"""A matrix further from orthonormal than this is a scaled one: hose and chain segments, not bodies."""

# --- mobility ---------------------------------------------------------------------------------
MOBILITY_LENGTH: Final = 2 * PITCH
"""Length by which translations are divided in the mobility matrix, so that all entries are O(1)
(40 LDU; with it the cut below separated motions from stiffness on all of 37 real models)."""

MOBILITY_CUT: Final = 3e-3
"""Singular values of the mobility matrix below this are motions. On real models true motions stay
below 1e-3 (posed linkages in hand-placed files reach 1e-5 to 1e-3) and true stiffness above 1.1e-2."""

MOBILITY_GAP: Final = 3.0
"""The verdict is `undetermined` when the smallest singular value kept exceeds the largest dropped by
less than this factor: nothing then separates motion from stiffness."""

MOTION_KIND_CUT: Final = 2e-2
"""Looser cut used when motions are sorted into kinds, because idle spins mix with structural motions
from a placement noise of 0.05 degrees on."""

MAIN_COMPONENT_SHARE: Final = 0.8
"""The model is `disconnected` when its biggest component holds less than this share of the parts
that carry structure."""

PIVOT_ZERO: Final = 1e-3
"""Singular values of one body's own columns below this are free motions of that body (true motions
stay below it, see `MOBILITY_CUT`)."""

PIVOT_CLEAR: Final = 5e-2
"""A body is eliminated only when its other singular values exceed this, so that errors grow by at
most a factor of twenty per step; unclear bodies go into the dense core."""

WHEEL_BALANCE: Final = 1.0 * LDU
"""A wheel's centre of mass lies this close to its axle: real wheels and gears are exact, a lever's
centre of mass is at least a quarter of a pitch away."""

WHEEL_ROUNDNESS: Final = 0.05
"""Relative spread of the second moments of mass across the axle up to which a body is round; a 2L beam
about its middle has 0.7, a gear with an axle hole below 0.01."""

SAME_LINE: Final = 1.0 * LDU
"""Joints whose lines are this close share a line."""

# --- numerics ---------------------------------------------------------------------------------
EIGEN_RESIDUAL: Final = 1e-3
"""Largest accepted relative residual |lambda G M x - x| of a reported eigenpair: reports print three
digits. Rounding in springs a billion times stiffer than the mode makes 1e-5 to 1e-4 (steel beams on soft
joints), on LEGO models 1e-8; a failed iteration makes 1."""

CONSTRAINT_COMPLIANCE: Final = 1e-9
"""Compliance of a motion that is held rigidly, in units of the compliance of the model's stiffest spring:
nothing that shows in a report, and a million times above rounding, which settles redundant constraints."""

DRIVEN_MOTION: Final = 1e-6
"""Loads drive a motion when their work on it exceeds this share of what they could do: rounding makes
1e-12, a load that misses the balance by a thousandth of a millimetre of lever makes 1e-5."""

STATIC_RESIDUAL: Final = 1e-10
"""The static solution has converged when the last step of refinement is this small beside the whole."""

LARGE_TURN: Final = 0.1
"""Rotation of a part (rad) above which a static answer warns: what linear mechanics leaves out is of the
order of half its square, 0.5 % there."""

LATTICE_POINT: Final = 1e-3
"""A point lies on the lattice when it is this close (LDU): exports of editors are off by 1e-4, and a tenth
of an LDU is the finest step that a model on the grid uses."""

LATTICE_DIRECTION: Final = 1e-5
"""A direction is rational when it is this close to a fraction: files give six decimals."""
