"""How rigid is a LEGO Technic model, which load does it resist least, and which beam helps?

>>> import technic
>>> assembly = technic.load("model.ldr")            # doctest: +SKIP
>>> report = technic.analyze(assembly)              # doctest: +SKIP
>>> report.verdict, report.rigidity.value           # doctest: +SKIP

The names below are the public interface; they are loaded when first used, so that ``import technic``
costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from technic.assembly.builder import Linkage
    from technic.assembly.model import Assembly
    from technic.design.optimize.solve import optimize
    from technic.design.suggest import suggest
    from technic.errors import TechnicError
    from technic.loading import load, save
    from technic.rigidity.analyze import analyze
    from technic.rigidity.result import RigidityReport
    from technic.statics.calibration import calibrate
    from technic.system.assemble import System, assemble

__version__ = "0.1.0"

_HOMES = {
    "Assembly": "technic.assembly.model",
    "Linkage": "technic.assembly.builder",
    "RigidityReport": "technic.rigidity.result",
    "System": "technic.system.assemble",
    "TechnicError": "technic.errors",
    "analyze": "technic.rigidity.analyze",
    "assemble": "technic.system.assemble",
    "calibrate": "technic.statics.calibration",
    "load": "technic.loading",
    "optimize": "technic.design.optimize.solve",
    "save": "technic.loading",
    "suggest": "technic.design.suggest",
}
"""Where each public name lives."""

__all__ = [
    "Assembly",
    "Linkage",
    "RigidityReport",
    "System",
    "TechnicError",
    "__version__",
    "analyze",
    "assemble",
    "calibrate",
    "load",
    "optimize",
    "save",
    "suggest",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first asked for (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'technic' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
