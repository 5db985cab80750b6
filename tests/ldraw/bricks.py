"""Hand-written parts for the tests of the connections: dimensions in LDU, as LDraw has them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count

import numpy as np

from technic.assembly.model import Part, Source
from technic.geometry import Pose
from technic.parts.definition import MassProperties, PartDefinition, Port, PortKind, RigidBody
from technic.units import LDU

X, Y, Z = np.eye(3)
AXES = {"x": X, "y": Y, "z": Z}
_lines = count(1)


def port(name, kind, position, axis, length, **extra):
    """Return a port from LDU."""
    return Port(
        name, PortKind(kind), np.array(position) * LDU, np.array(axis), length * LDU, **extra
    )


def define(number: str, title: str, ports: Sequence[Port], *, fastener: bool = False):
    """Return a definition with some mass."""
    mass = MassProperties(1e-3, np.zeros(3), np.eye(3) * 1e-8)
    return PartDefinition(number, title, "test", tuple(ports), RigidBody(), mass, fastener)


def beam(holes: int):
    """Return a beam along z with bores along y, 20 LDU deep."""
    middle = (holes - 1) / 2
    ports = [
        port(f"hole{k + 1}", "pin_hole", [0, 0, 20 * (k - middle)], Y, 20) for k in range(holes)
    ]
    return define(f"beam{holes}", f"Beam {holes}", ports)


def thin_beam(holes: int):
    """Return a half-thick beam along z, bores along y from 0 to 10."""
    ports = [port(f"hole{k + 1}", "pin_hole", [0, 5, 20 * k], Y, 10) for k in range(holes)]
    return define(f"thin{holes}", f"Thin beam {holes}", ports)


def pin(length: int = 2):
    """Return a pin along x, of `length` sections of 20 LDU, middle at the origin."""
    ports = [
        port(f"end{k + 1}", "pin", [20 * (k - (length - 1) / 2), 0, 0], X, 20, friction=True)
        for k in range(length)
    ]
    return define(f"pin{length}", f"Pin {length}", ports, fastener=True)


def axle(length: int, *, stop: bool = False):
    """Return an axle along x, `length` times 20 LDU; with `stop`, a collar 4 thick at its -x end."""
    ports = [port("axle", "axle", [0, 0, 0], X, 20 * length)]
    if stop:
        ports.append(port("stop", "stop", [-10 * length + 2, 0, 0], X, 4))
    return define(f"axle{length}", f"Axle {length}", ports, fastener=True)


def bush(length: float = 20):
    """Return a bush along z."""
    return define("bush", "Bush", [port("hole", "axle_hole", [0, 0, 0], Z, length)], fastener=True)


def gear():
    """Return a gear along z: an axle hole, 20 deep."""
    return define("gear", "Gear", [port("hole", "axle_hole", [0, 0, 0], Z, 20)])


def axle_pin():
    """Return an axle pin along x: the pin at +x, the axle at -x."""
    ports = [port("pin", "pin", [10, 0, 0], X, 20), port("axle", "axle", [-10, 0, 0], X, 20)]
    return define("axlepin", "Axle pin", ports, fastener=True)


def turn(source: str, target: str) -> np.ndarray:
    """Return the rotation that takes one coordinate axis to another."""
    if source == target:
        return np.eye(3)
    a, b = AXES[source], AXES[target]
    c = np.cross(a, b)
    return np.outer(b, a) + np.outer(c, c) - np.outer(a, b)


def rotation(axis: Sequence[float], degrees: float) -> np.ndarray:
    """Return a rotation about an axis."""
    from scipy.spatial.transform import Rotation

    unit = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return Rotation.from_rotvec(np.radians(degrees) * unit).as_matrix()


def place(definition: PartDefinition, position, turned=None) -> Part:
    """Return a part at a position in LDU."""
    line = next(_lines)
    matrix = np.eye(3) if turned is None else turned
    return Part(
        id=f"test.ldr/{line}:{definition.id}",
        number=definition.id,
        name=definition.title,
        pose=Pose(matrix, np.array(position, dtype=float) * LDU),
        ports=definition.ports,
        body=definition.body,
        mass_properties=definition.mass_properties,
        fastener=definition.fastener,
        source=Source("test.ldr", line),
        definition=definition,
    )
