"""Command-line options that several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import typer

__all__ = [
    "AS_FOUND",
    "AnalysisOptions",
    "AnimateOption",
    "AxleSlide",
    "AxleSlideOption",
    "CalibrationOption",
    "CsvOption",
    "DepthOption",
    "FixOption",
    "Gears",
    "GearsOption",
    "GltfOption",
    "HeatmapOption",
    "InnerMotion",
    "InnerOption",
    "JsonOption",
    "LibraryOption",
    "LibrarySolids",
    "LibrarySolidsOption",
    "MaterialOption",
    "Measure",
    "MeasureOption",
    "MinRigidityOption",
    "ModelOptions",
    "ModesOption",
    "NoLibraryOption",
    "OverridesOption",
    "PartModel",
    "PartModelOption",
    "PictureOption",
    "PortWalls",
    "PortWallsOption",
    "QuietOption",
    "RendererOption",
    "ReportOption",
    "RequireRigidOption",
    "ShadowOption",
    "TransparentOption",
    "View",
    "ViewOption",
]


Measure = Literal["mean_square", "nodal"]
AxleSlide = Literal["held", "free"]
Gears = Literal["off", "on"]
InnerMotion = Literal["held", "free"]
LibrarySolids = Literal["draft", "fine", "off"]
PartModel = Literal["solid", "frame", "rigid"]
PortWalls = Literal["mean", "rigid"]
View = Literal["iso", "front", "side", "top", "mode"]
Renderer = Literal["pyvista", "pyrender"]
"""The values that `technic.rigidity.analyze.analyze`, the LDraw reader and the pictures take."""

JsonOption = Annotated[
    str | None,
    typer.Option("--json", metavar="PATH|-", help="Write the report as JSON; - is stdout."),
]
PictureOption = Annotated[
    Path | None, typer.Option("--picture", metavar="PNG", help="Draw the result into a PNG file.")
]
ReportOption = Annotated[
    Path | None,
    typer.Option(
        "--report",
        metavar="HTML",
        help="Write a page with the model in 3D, its motions and tables.",
    ),
]
HeatmapOption = Annotated[
    Path | None,
    typer.Option(
        "--heatmap",
        metavar="MPD",
        help="Write the model again with every part in the colour of its strain energy.",
    ),
]
GltfOption = Annotated[
    Path | None,
    typer.Option("--gltf", metavar="GLB", help="Write the model with its worst mode as glTF."),
]
CsvOption = Annotated[
    Path | None, typer.Option("--csv", metavar="DIR", help="Write the tables as CSV files.")
]
AnimateOption = Annotated[
    Path | None,
    typer.Option(
        "--animate", metavar="GIF|MP4", help="Draw the worst mode as an animation, .gif or .mp4."
    ),
]
ViewOption = Annotated[
    View, typer.Option("--view", help="Of pictures; mode: the view that shows the worst mode best.")
]
RendererOption = Annotated[
    Renderer,
    typer.Option("--renderer", help="What draws pictures; pyrender is an extra to install."),
]
TransparentOption = Annotated[
    bool, typer.Option("--transparent", help="With --picture: leave the background out.")
]
DepthOption = Annotated[
    bool,
    typer.Option("--depth", help="With --picture: shades of distance instead of colours."),
]
FixOption = Annotated[
    list[str] | None,
    typer.Option(
        "--fix",
        metavar="PART[:PORT]",
        help="Hold a part (its id, the end of it, or a number the model has once) or one of its "
        "ports to the ground. May be repeated.",
    ),
]
MeasureOption = Annotated[
    Measure,
    typer.Option(
        "--measure", help="mean_square: N/m, whatever the mesh; nodal: the measure of the paper."
    ),
]
AxleSlideOption = Annotated[
    AxleSlide,
    typer.Option("--axle-slide", help="Axles in axle holes: held by friction, or free to slide."),
]
CalibrationOption = Annotated[
    Path | None,
    typer.Option(
        "--calibration",
        metavar="TOML",
        help="Stiffness table from `technic calibrate`. Left out: the one that technic.toml names "
        "(beside the model, or in your settings), else the shipped one; shipped: always that.",
    ),
]
GearsOption = Annotated[
    Gears,
    typer.Option("--gears", help="on: gears in mesh turn each other, a worm locks its gear."),
]
InnerOption = Annotated[
    InnerMotion,
    typer.Option(
        "--inner",
        help="Motors and actuators: held like braked ones, or their outputs free to move.",
    ),
]
OverridesOption = Annotated[
    Path | None,
    typer.Option(
        "--overrides",
        metavar="TOML",
        help="Your corrections: connections to add, remove or retype, parts to ignore or to weld.",
    ),
]
LibraryOption = Annotated[
    Path | None,
    typer.Option(
        "--library",
        metavar="DIR|ZIP",
        help="LDraw parts library, for parts that the catalogue does not have. Left out: LDRAWDIR, "
        "or the usual places.",
    ),
]
LibrarySolidsOption = Annotated[
    LibrarySolids,
    typer.Option(
        "--library-solids",
        help="How parts of the library are meshed: draft (1.6 mm), fine (0.8 mm, like the shipped "
        "models: up to minutes and gigabytes a part), off (rigid bodies). Kept in the cache.",
    ),
]
NoLibraryOption = Annotated[
    bool, typer.Option("--no-library", help="Do not use a parts library, even if there is one.")
]
ShadowOption = Annotated[
    Path | None,
    typer.Option(
        "--shadow",
        metavar="DIR|ZIP",
        help="LDCad shadow library: connectors of the library's parts. Left out: TECHNIC_SHADOW.",
    ),
]
ModesOption = Annotated[
    int, typer.Option("--modes", min=1, max=200, metavar="K", help="How many elastic modes.")
]
PartModelOption = Annotated[
    PartModel,
    typer.Option(
        "--parts",
        help="solid: condensed solid models, frame members where none is shipped; frame: beams "
        "bend; rigid: only joints give way.",
    ),
]
PortWallsOption = Annotated[
    PortWalls,
    typer.Option(
        "--port-walls",
        help="rigid: also give the answer with bores that keep their shape, the stiffest that it can "
        "be; models for it are built when first needed and kept in the cache.",
    ),
]
MaterialOption = Annotated[
    list[str] | None,
    typer.Option(
        "--material",
        metavar="NAME|PART=NAME",
        help="Material of the whole model, of a part, or of all parts of a number: ABS, PC, POM, PA. "
        "May be repeated.",
    ),
]
RequireRigidOption = Annotated[
    bool, typer.Option("--require-rigid", help="Exit with 1 when the model is not rigid.")
]
MinRigidityOption = Annotated[
    float | None,
    typer.Option(
        "--min-rigidity", min=0.0, metavar="N/m", help="Exit with 1 when the rigidity is lower."
    ),
]
QuietOption = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="No text: only the files asked for, and the exit code."),
]


@dataclass(frozen=True, slots=True)
class ModelOptions:
    """How a model file is read: where unknown parts come from, what holds, and what moves.

    Parameters
    ----------
    axle_slide : {"held", "free"}
        Whether friction holds parts on the axles that they grip.
    calibration : Path or None
        Stiffness table to use instead of the shipped one.
    gears : {"off", "on"}
        Whether gears in mesh turn each other.
    inner : {"held", "free"}
        Whether motors and actuators hold their position.
    overrides : Path or None
        File of corrections.
    library : Path or None
        LDraw parts library; None: the one that is found in the usual places, if there is one.
    no_library : bool
        Do not look for one.
    library_solids : {"draft", "fine", "off"}
        How finely parts of the library are meshed.
    shadow : Path or None
        LDCad shadow library.
    """

    axle_slide: AxleSlide = "held"
    calibration: Path | None = None
    gears: Gears = "off"
    inner: InnerMotion = "held"
    overrides: Path | None = None
    library: Path | None = None
    no_library: bool = False
    library_solids: LibrarySolids = "draft"
    shadow: Path | None = None


AS_FOUND: Final = ModelOptions()
"""Nothing asked for."""


@dataclass(frozen=True, slots=True)
class AnalysisOptions:
    """What the caller of `technic analyze` asked for."""

    json: str | None = None
    picture: Path | None = None
    report: Path | None = None
    heatmap: Path | None = None
    gltf: Path | None = None
    csv: Path | None = None
    animate: Path | None = None
    view: View = "mode"
    renderer: Renderer = "pyvista"
    transparent: bool = False
    depth: bool = False
    how: ModelOptions = AS_FOUND
    fix: tuple[str, ...] = ()
    measure: Measure = "mean_square"
    modes: int = 6
    parts: PartModel = "solid"
    port_walls: PortWalls = "mean"
    material: tuple[str, ...] = ()
    require_rigid: bool = False
    min_rigidity: float | None = None
    quiet: bool = False
