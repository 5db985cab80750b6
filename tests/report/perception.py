"""How alike two pictures look: the same up to smoothed edges, not the same when something moved.

The structural similarity is that of Wang et al., "Image quality assessment: from error visibility to
structural similarity", IEEE Trans. Image Process. 13 (2004) 600, on squares instead of Gaussians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import uniform_filter

SMALL = (400, 300)
"""Pictures are compared and kept at this size: edges and letters are smoothed away, shapes are not."""

_WINDOW = 7
_CONSTANTS = ((0.01 * 255.0) ** 2, (0.03 * 255.0) ** 2)

LEAST_LIKENESS = 0.93
MOST_STRANGE = 0.002
"""Bounds between what renderers do differently and what is a different picture; test_golden.py measures
both sides of them."""

_STRANGE = 45.0
"""Levels of 255 by which a smoothed spot must differ to be strange."""


def small(image: Image.Image) -> NDArray[np.uint8]:
    """Return a picture on white at the size of comparison, (height, width, 3)."""
    image = image.convert("RGBA")
    white = Image.alpha_composite(Image.new("RGBA", image.size, "white"), image).convert("RGB")
    return np.asarray(white.resize(SMALL, Image.Resampling.BOX))


@dataclass(frozen=True)
class Likeness:
    """Mean structural similarity (1: the same) and the share of spots with another colour."""

    similarity: float
    strange: float

    @property
    def same(self) -> bool:
        return self.similarity >= LEAST_LIKENESS and self.strange <= MOST_STRANGE


def likeness(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> Likeness:
    """Compare two pictures of one size."""
    a, b = one.astype(float), other.astype(float)
    window = (_WINDOW, _WINDOW, 1)

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return uniform_filter(values, window, mode="nearest")

    ma, mb = mean(a), mean(b)
    va, vb, cov = mean(a * a) - ma**2, mean(b * b) - mb**2, mean(a * b) - ma * mb
    c1, c2 = _CONSTANTS
    ssim = (2 * ma * mb + c1) * (2 * cov + c2) / ((ma**2 + mb**2 + c1) * (va + vb + c2))
    smooth = (3, 3, 1)
    gap = np.abs(uniform_filter(a, smooth) - uniform_filter(b, smooth)).max(axis=2)
    return Likeness(float(ssim.mean()), float((gap > _STRANGE).mean()))
