"""The JSON object of the contract ``technic-report/1``: all keys, finite numbers, consistent values."""

from __future__ import annotations

import json

import jsonschema
import numpy as np
import pytest

from technic.report.json import dumps
from technic.rigidity.serialize import unit_load

NUMBER = {"type": "number"}
OPTIONAL = {"type": ["number", "null"]}
TEXT = {"type": "string"}
COUNT = {"type": "integer", "minimum": 0}
VECTOR = {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3}
VERDICT = {"enum": ["rigid", "flexible", "disconnected", "undetermined"]}


def record(**keys):
    """Object schema in which all keys are required."""
    return {"type": "object", "required": list(keys), "properties": keys}


def rows(**keys):
    """Array of such objects."""
    return {"type": "array", "items": record(**keys)}


TEXTS = {"type": "array", "items": TEXT}
MOBILITY = record(
    total=COUNT,
    structural=COUNT,
    spinning=COUNT,
    sliding=COUNT,
    idle=COUNT,
    proof={"enum": ["exact", "numerical"]},
    singular_value_gap={"type": "array", "items": OPTIONAL, "minItems": 2, "maxItems": 2},
)
RIGIDITY = {
    "oneOf": [
        {"type": "null"},
        record(
            value_n_per_m=NUMBER,
            compliance_mm_per_n=NUMBER,
            frequency_hz=OPTIONAL,
            interval_95={"type": ["array", "null"]},
            measure={"enum": ["mean_square", "nodal"]},
            residual=NUMBER,
        ),
    ]
}
CONTRACT = record(
    schema={"const": "technic-report/1"},
    source=record(path=TEXT, sha256=TEXT, format={"enum": ["ldraw", "assembly"]}),
    model=record(
        name=TEXT,
        parts=COUNT,
        joints=COUNT,
        components=COUNT,
        dof=COUNT,
        mass_kg=NUMBER,
        size_mm=VECTOR,
        unknown_parts=rows(id=TEXT, count=COUNT, lines={"type": "array", "items": COUNT}),
        near_misses={"type": "array"},
        open_ports=COUNT,
        warnings={"type": "array"},
    ),
    verdict=VERDICT,
    mobility=MOBILITY,
    motions=rows(
        kind={"enum": ["structural", "spinning", "sliding", "idle"]},
        order={"enum": ["finite", "first-order", None]},
        second_order={"enum": ["stiffens", "undecided", None]},
        type={"enum": ["rotation", "translation", "screw", "general"]},
        axis={"oneOf": [{"type": "null"}, {"required": ["point", "direction"]}]},
        parts=TEXTS,
        freed_by=TEXTS,
    ),
    rigidity=RIGIDITY,
    spectrum_n_per_m={"type": "array", "items": NUMBER},
    worst_case=record(
        parts=rows(
            id=TEXT,
            part_number=TEXT,
            force_n=VECTOR,
            moment_nm=VECTOR,
            displacement_mm=VECTOR,
            rotation_rad=VECTOR,
        )
    ),
    weak_spots=rows(
        rank=COUNT,
        kind={"enum": ["joint", "part"]},
        id=TEXT,
        energy_share=NUMBER,
        parts=TEXTS,
        part_numbers=TEXTS,
        submodel={"type": ["string", "null"]},
        step={"type": ["integer", "null"]},
        line={"type": ["integer", "null"]},
    ),
    components=rows(
        parts=TEXTS, mass_kg=NUMBER, verdict=VERDICT, mobility=MOBILITY, rigidity=RIGIDITY
    ),
    joint_stiffness=rows(type=TEXT, values={"type": "object"}, provenance=TEXT),
    not_modelled=TEXTS,
    timings_s={"type": "object"},
    technic_version=TEXT,
)


@pytest.mark.parametrize("name", ["pair", "scissors"])
def test_report_obeys_the_contract(name, request):
    content = json.loads(dumps(request.getfixturevalue(name).to_dict()))
    jsonschema.validate(content, CONTRACT)


def test_contract_schema_can_fail(pair):
    content = pair.to_dict()
    del content["mobility"]["idle"]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(content, CONTRACT)


def test_ids_lead_back_to_the_file(pair):
    content = pair.to_dict()
    known = {part.id for part in pair.assembly.parts}
    assert {row["id"] for row in content["worst_case"]["parts"]} <= known
    assert set(content["components"][0]["parts"]) == known
    for spot in content["weak_spots"]:
        assert spot["submodel"] == "pair.ldr"
        # Lines 5 and 6 hold the pins; a weak spot inside a beam is on line 2 or 3.
        assert spot["line"] in ((5, 6) if spot["kind"] == "joint" else (2, 3, 5, 6))
        assert spot["step"] == (2 if spot["line"] >= 5 else 1)


def test_worst_load_of_one_newton_does_the_work_that_the_rigidity_says(make_report, models):
    report = make_report(models["pair"], parts="rigid")
    load = unit_load(report)
    assert load is not None
    forces, twists = load
    # Rigid parts: the work of the forces and moments is all the work there is, f.x = 1 N * (1 N / lambda).
    assert np.sum(forces * twists) == pytest.approx(1.0 / report.rigidity.value, rel=1e-9)


def test_worst_load_is_in_equilibrium(pair):
    rows_ = pair.to_dict()["worst_case"]["parts"]
    index = {part.id: part for part in pair.assembly.parts}
    forces = np.array([row["force_n"] for row in rows_])
    moments = np.array([row["moment_nm"] for row in rows_])
    arms = np.array([index[row["id"]].centroid for row in rows_])
    assert np.abs(forces).sum() > 0.1
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose((moments + np.cross(arms, forces)).sum(axis=0), 0.0, atol=1e-10)


def test_sum_of_forces_is_at_most_the_load(pair, scissors):
    for report in (pair, scissors):
        worst = report.to_dict()["worst_case"]
        assert 0.0 < worst["sum_of_forces_n"] <= 1.0 + 1e-9


def test_size_of_two_stacked_beams(pair):
    # Beams of 5 modules, 18 LDU wide and 2 x 20 LDU high; pins end flush with the beams.
    np.testing.assert_allclose(pair.to_dict()["model"]["size_mm"], [7.2, 16.0, 39.2], atol=1e-9)


def test_same_file_gives_the_same_report_twice(make_report, models):
    first, second = (make_report(models["scissors"]).to_dict() for _ in range(2))
    for content in (first, second):
        content.pop("timings_s")
        content["source"].pop("path")
    assert dumps(first) == dumps(second)
