"""From a body and the points where joints attach to it, to its element."""

from __future__ import annotations

import numpy as np

from technic.fem.element import Element
from technic.fem.frame import frame_element
from technic.fem.rigid import rigid_element
from technic.geometry import Array
from technic.parts.definition import Body, FrameBody, MassProperties

__all__ = ["build_element"]


def build_element(body: Body, properties: MassProperties, attachments: Array) -> Element:
    """Return the element of a body, in part axes.

    Parameters
    ----------
    body : Body
    properties : MassProperties
    attachments : (m, 3) array_like
        Points where joints and supports attach, part coordinates (m).
    """
    points = np.asarray(attachments, dtype=float).reshape(-1, 3)
    if isinstance(body, FrameBody):
        return frame_element(body, properties, points)
    return rigid_element(properties, points)
