"""Small assemblies made by hand for tests of the mechanics."""

from __future__ import annotations

import numpy as np

from technic.assembly.joint_types import HELD, JointType
from technic.assembly.model import Assembly, Joint, Part, Support
from technic.geometry import Pose, axes_from
from technic.parts.definition import FrameBody, MassProperties, Material, RigidBody, Section

PLASTIC = Material("plastic", 2e9, 0.35, 1000.0, "round numbers")
STEEL = Material("steel", 200e9, 0.3, 7800.0, "round numbers")


def square_section(side, *, shear=True):
    """Section of a solid square; torsion constant 0.1406 a^4 (Timoshenko and Goodier, section 109)."""
    inertia = side**4 / 12
    area = side**2
    shear_area = 5 / 6 * area if shear else float("inf")
    return Section(area, inertia, inertia, 0.1406 * side**4, shear_area, shear_area)


def beam(name, p, q, side=0.01, *, material=STEEL, stretch=np.inf, pose=None, shear=True):
    """Prismatic beam from p to q, given in part coordinates."""
    p, q = np.asarray(p, float), np.asarray(q, float)
    length = np.linalg.norm(q - p)
    x = (q - p) / length
    mass = material.density * side**2 * length
    across = mass * (length**2 + side**2) / 12
    inertia = across * (np.eye(3) - np.outer(x, x)) + mass * side**2 / 6 * np.outer(x, x)
    normal = axes_from(x)[1]
    body = FrameBody(
        np.array([p, q]),
        [[0, 1]],
        (square_section(side, shear=shear),),
        np.array([normal]),
        material,
        stretch,
    )
    properties = MassProperties(mass, (p + q) / 2, inertia)
    return Part(name, "", name, pose or Pose.identity(), (), body, properties)


def block(name, at, mass=1.0, radius=0.01, *, fastener=False):
    """Rigid ball-like body."""
    properties = MassProperties(mass, np.zeros(3), 0.4 * mass * radius**2 * np.eye(3))
    pose = Pose(np.eye(3), np.asarray(at, float))
    return Part(name, "", name, pose, (), RigidBody(), properties, fastener)


def joint(a, b, at, kind=JointType.FIXED, axis=(0, 0, 1), stiffness=np.inf):
    """Joint; `stiffness` is one number for all motions or six."""
    values = np.broadcast_to(np.asarray(stiffness, float), 6)
    return Joint(
        f"{a}-{b}@{at}", kind, (a, b), np.asarray(at, float), axes_from(axis), HELD[kind], values
    )


def assembly(parts, joints=(), supports=(), dimension=3):
    """Assembly without a file."""
    return Assembly("test", tuple(parts), tuple(joints), tuple(supports), dimension)


def clamp(part, at):
    """Support that holds everything at a point."""
    return Support(part, np.asarray(at, float), np.ones(6, bool))


def moved(model, pose):
    """The whole assembly in another place."""
    from dataclasses import replace

    parts = [replace(p, pose=pose @ p.pose) for p in model.parts]
    joints = [
        replace(j, point=pose.points(j.point), axes=pose.directions(j.axes)) for j in model.joints
    ]
    supports = [
        replace(s, point=None if s.point is None else pose.points(s.point)) for s in model.supports
    ]
    return replace(model, parts=tuple(parts), joints=tuple(joints), supports=tuple(supports))
