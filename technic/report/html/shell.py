"""What every page has: escaping, style, script, and a policy that lets nothing else in."""

from __future__ import annotations

import base64
import hashlib
import io
import json
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["embedded", "render"]

_PICTURE_WIDTH = 1280


def _asset(name: str) -> str:
    return files("technic.report.html").joinpath("assets", name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    # Names in model files are anybody's: everything is escaped unless the template says otherwise.
    return Environment(
        loader=PackageLoader("technic.report.html"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _hash(text: str) -> str:
    """Return the source expression of the policy that admits exactly this text."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def _json(content: Any) -> str:
    """Return JSON that may stand inside a script element: no letter that could end it."""
    text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def embedded(picture: bytes) -> str:
    """Return a PNG as a smaller picture, on white, in a data address."""
    from PIL import Image

    image = Image.open(io.BytesIO(picture)).convert("RGBA")
    image = Image.alpha_composite(Image.new("RGBA", image.size, "white"), image).convert("RGB")
    if image.width > _PICTURE_WIDTH:
        height = round(image.height * _PICTURE_WIDTH / image.width)
        image = image.resize((_PICTURE_WIDTH, height), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    image.save(stream, format="WEBP", quality=82, method=4)
    return "data:image/webp;base64," + base64.b64encode(stream.getvalue()).decode("ascii")


def render(template: str, contents: dict[str, Any] | None, block: str, **words: Any) -> str:
    """Return a page that asks for nothing from outside.

    Parameters
    ----------
    template : str
        Its name.
    contents : dict or None
        What the viewer reads; None for a page without one.
    block : str
        The arrays, see `technic.report.html.pack.Block`.
    **words
        What the template asks for besides.
    """
    import technic

    style, script = _asset("page.css"), _asset("viewer.js")
    scripts = _hash(script) if contents is not None else "'none'"
    policy = (
        f"default-src 'none'; script-src {scripts}; style-src {_hash(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    return (
        _environment()
        .get_template(template)
        .render(
            policy=policy,
            style=style,
            script=script,
            licence=_asset("LICENSE.three.txt"),
            version=technic.__version__,
            contents=contents,
            contents_json=None if contents is None else _json(contents),
            block=block,
            **words,
        )
    )
