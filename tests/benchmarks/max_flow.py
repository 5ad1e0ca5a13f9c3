#!/usr/bin/env python3
"""Maximum flow beside PyMaxflow (Boykov & Kolmogorov's own code) on the same grids, as ratios.

Needs numpy and PyMaxflow (pip install PyMaxflow) and cargo. Run from anywhere:

    python3 tests/benchmarks/max_flow.py [SIDE] [RUNS]

Each grid is solved RUNS times by each program in turn and the fastest run counts. A ratio below 1 means that
gable-graph-cut is faster. Fails if any flow differs.
"""
import pathlib
import subprocess
import sys
import tempfile
import time

import maxflow
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
RIGHT = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 0]])
UP = np.array([[0, 0, 0], [0, 0, 0], [0, 1, 0]])


def grids(side):
    """Name, terminals, weights to the right and up."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[0:side, 0:side]
    pattern = np.where((x // 40 + y // 40) % 2 == 0, 8000, -8000)
    noise = rng.integers(0, 65536, (2, side, side))
    weights = np.full((side, side), 20000)
    yield "coin tosses, smooth", noise[0] - noise[1] + pattern, weights, weights
    yield "coin tosses, rough", noise[0] - noise[1] + pattern, weights // 4, weights // 4
    # Blobs with noisy edges: most pixels are certain.
    height = np.sin(x / 23.0) * np.sin(y / 31.0) + 0.3 * rng.standard_normal((side, side))
    step = lambda a, axis: np.append(np.abs(np.diff(a, axis=axis)), np.zeros_like(a.take([0], axis)), axis)
    weight = lambda axis: (20000 * np.exp(-step(height, axis))).astype(int)
    yield "blobs", (40000 * height).astype(int), weight(1), weight(0)


def pymaxflow(terminal, right, up):
    start = time.perf_counter()
    side = terminal.shape[0]
    graph = maxflow.GraphInt(side * side, 2 * side * side)
    nodes = graph.add_grid_nodes(terminal.shape)
    graph.add_grid_edges(nodes, right, structure=RIGHT, symmetric=True)
    graph.add_grid_edges(nodes, up, structure=UP, symmetric=True)
    graph.add_grid_tedges(nodes, np.maximum(terminal, 0), np.maximum(-terminal, 0))
    set_up = time.perf_counter() - start
    start = time.perf_counter()
    flow = graph.maxflow()
    return flow, set_up, time.perf_counter() - start


def main():
    side = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    build = ["cargo", "build", "--release", "-q", "-p", "gable-graph-cut", "--example", "max_flow"]
    subprocess.run(build, cwd=ROOT, check=True)
    command = ["cargo", "run", "--release", "-q", "-p", "gable-graph-cut", "--example", "max_flow", "--"]
    print(f"{side} x {side} pixels, fastest of {runs} runs; seconds, and gable / PyMaxflow")
    print(f"{'':22}{'PyMaxflow':>20}{'grid':>10}{'graph':>10}{'grid, all':>12}{'graph, all':>12}{'graph, solve':>14}")
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "grid.bin"
        for name, terminal, right, up in grids(side):
            np.concatenate([[side, side], terminal.ravel(), right.ravel(), up.ravel()]).astype("<i4").tofile(file)
            best = {}
            for _ in range(runs):
                results = {"py": pymaxflow(terminal, right, up)}
                lines = subprocess.run([*command, file], cwd=ROOT, check=True, capture_output=True, text=True).stdout
                for line in lines.splitlines():
                    kind, flow, set_up, solve = line.split()
                    results[kind] = (int(flow), float(set_up), float(solve))
                assert len({flow for flow, _, _ in results.values()}) == 1, f"{name}: flows differ: {results}"
                for kind, (_, set_up, solve) in results.items():
                    old = best.get(kind, (9e9, 9e9))
                    best[kind] = (min(old[0], set_up), min(old[1], solve))
            total = {kind: sum(times) for kind, times in best.items()}
            print(
                f"{name:22}{best['py'][0]:9.3f} + {best['py'][1]:.3f}s{total['grid']:9.3f}s{total['graph']:9.3f}s"
                f"{total['grid'] / total['py']:12.2f}{total['graph'] / total['py']:12.2f}"
                f"{best['graph'][1] / best['py'][1]:14.2f}"
            )


if __name__ == "__main__":
    main()
