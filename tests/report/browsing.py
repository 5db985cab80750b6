"""A browser for the tests of pages, and what it saw."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image

FLAGS = [
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    # Draw without a graphics card.
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]


class Visit:
    """An open page with everything that it said and asked for."""

    def __init__(self, browser, path: Path, **context) -> None:
        context = {"viewport": {"width": 1000, "height": 900}, "reduced_motion": "reduce"} | context
        self.context = browser.new_context(**context)
        self.page = self.context.new_page()
        self.page.set_default_timeout(20_000)
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.address = path.as_uri()
        self.page.goto(self.address)
        self.page.wait_for_selector("#viewer.live canvas[data-drawn]")

    def canvas(self, where: str = "#canvas") -> np.ndarray:
        """Pixels of the model, (height, width, 3), two frames after now."""
        self.page.evaluate(
            "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )
        picture = self.page.locator(where).screenshot()
        # Without the stage's border.
        return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)[4:-4, 4:-4]


def differ(one: np.ndarray, other: np.ndarray) -> int:
    """Pixels that differ clearly."""
    return int((np.abs(one - other).max(axis=2) > 30).sum())


def near(pixels: np.ndarray, color: tuple[int, int, int], within: int = 45) -> int:
    """Pixels near a colour."""
    return int((np.abs(pixels - np.array(color)).max(axis=2) < within).sum())
