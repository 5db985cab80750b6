"""Gradient of the worst-case rigidity by vertices: element by element, against automatic differentiation.

    python benchmarks/optimize.py [NODES ...]

The rival is what the paper did: dense K and M as functions of the node places, `torch.linalg.eigh`, and
its backward pass. PyTorch is needed by this benchmark only; without it the sparse gradient is timed alone.
"""

from __future__ import annotations

import sys
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
from scipy import linalg

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from technic.assembly.builder import Linkage
from technic.design.optimize.modes import Tracker
from technic.design.optimize.moving import Model
from technic.design.optimize.objective import Motions, spectrum
from technic.design.optimize.vertices import find_geometry
from technic.system.inverse import single_thread

AREA, DENSITY, YOUNG = 9e-6, 1050.0, 2.2e9


def truss(nodes: int) -> tuple[Model, Motions, np.ndarray]:
    """Return a square net of truss bars with about that many ends of bars."""
    side = max(2, round(((nodes / 2.0) / 3.0) ** 0.5) + 1)
    corners = side * side
    random = np.random.default_rng(0)
    places = 0.05 * np.array([(k % side, k // side) for k in range(corners)], dtype=float)
    places += 0.003 * random.standard_normal(places.shape)
    linkage = Linkage(2)
    pairs = [(k, k + 1) for k in range(corners) if (k + 1) % side]
    pairs += [(k, k + side) for k in range(corners - side)]
    pairs += [(k, k + side + 1) for k in range(corners - side) if (k + 1) % side]
    for a, b in pairs:
        linkage.truss(f"{a}-{b}", places[a], places[b], area=AREA)
    for k in range(corners):
        own = [f"{a}-{b}" for a, b in pairs if k in (a, b)]
        linkage.hinge(*own, at=places[k], stiffness={"shear": 65625.0})
    assembly = linkage.assembly()
    geometry = find_geometry(assembly)
    model = Model(assembly, geometry)
    return model, Motions(model), geometry.positions


def timed(run: Any, times: int) -> float:
    """Return the median time of a call (s)."""
    spent = []
    for _ in range(times):
        began = perf_counter()
        run()
        spent.append(perf_counter() - began)
    return median(spent)


def by_torch(model: Model, positions: np.ndarray, torch: Any) -> Any:
    """Return a function that gives lambda_1 and its derivative through a dense eigh."""
    bars = model.trusses
    first, last = torch.tensor(bars.first), torch.tensor(bars.last)
    count = len(bars.first)
    rows = model.joint_rows(positions).toarray()
    joints = torch.tensor(rows.T @ (model.springs[:, None] * rows))
    here = np.arange(count)

    def gradient() -> tuple[float, np.ndarray]:
        x = torch.tensor(positions[:, :2], requires_grad=True)
        span = x[last] - x[first]
        length = span.norm(dim=1)
        outer = span[:, :, None] * span[:, None, :] * (YOUNG * AREA / length**3)[:, None, None]
        one = torch.cat([torch.cat([outer, -outer], 2), torch.cat([-outer, outer], 2)], 1)
        eye = torch.kron(torch.tensor([[2.0, 1.0], [1.0, 2.0]]), torch.eye(2)).double() / 6.0
        kilograms = DENSITY * AREA * length
        heavy = kilograms[:, None, None] * eye
        n = 4 * count
        k = torch.zeros(count, 4, count, 4, dtype=torch.float64)
        m = torch.zeros(count, 4, count, 4, dtype=torch.float64)
        k[here, :, here, :] = one
        m[here, :, here, :] = heavy
        stiffness = k.reshape(n, n) + joints
        mass = m.reshape(n, n) / kilograms.sum()
        lower = torch.linalg.cholesky(mass)
        half = torch.linalg.solve_triangular(lower, stiffness, upper=False)
        standard = torch.linalg.solve_triangular(lower, half.T, upper=False)
        values = torch.linalg.eigvalsh((standard + standard.T) / 2.0)
        values[3].backward()
        return float(values[3].detach()), x.grad.numpy()

    return gradient


def main(sizes: list[int]) -> None:
    """Print one line per size."""
    try:
        import torch
    except ImportError:
        torch = None
        print("PyTorch is not installed: only the sparse gradient is timed (pip install torch)")
    heads = ["nodes", "unknowns", "sparse (ms)", "dense eigh", "autodiff (ms)", "times", "apart"]
    print(" ".join(f"{head:>13}" for head in heads))
    with single_thread():  # two threads quarrel over matrices this small
        compare(sizes, torch)


def compare(sizes: list[int], torch: Any) -> None:
    """Print one line per size; `torch` is None where it is not installed."""
    for nodes in sizes:
        model, motions, positions = truss(nodes)
        tracker = Tracker(6)
        values, slopes = spectrum(model, motions, positions, tracker)
        ours = timed(lambda m=model, f=motions, x=positions, t=tracker: spectrum(m, f, x, t), 7)
        matrices = model.matrices(positions)
        k, m = matrices.stiffness.toarray(), matrices.measure.toarray()
        # the least that any way through a dense decomposition costs, without its derivative
        dense = timed(lambda k=k, m=m: linalg.eigh(k, m), 3)
        row = [2 * len(model.trusses.first), model.size, 1e3 * ours, 1e3 * dense]
        if torch is None:
            print(_line(row))
            continue
        torch.set_num_threads(1)
        rival = by_torch(model, positions, torch)
        value, slope = rival()
        apart = abs(slope - slopes[0][:, :2]).max() / abs(slope).max()
        assert abs(value - values[0]) < 1e-6 * values[0]
        assert apart < 1e-6
        theirs = timed(rival, 3)
        print(_line([*row, 1e3 * theirs, theirs / ours, apart]))


def _line(values: list[float]) -> str:
    return " ".join(f"{value:13.4g}" for value in values)


if __name__ == "__main__":
    main([int(a) for a in sys.argv[1:]] or [200, 400])
