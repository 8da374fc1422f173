"""A small network that tests train: two hidden layers, by Adam, on states to which noise is added.

Targets are where to be next, whatever the noise, so the network leads back to the ways that it has seen (as noise in
demonstrations does: Laskey et al., DART, CoRL 2017).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.policies.networks import onnx

Array = np.ndarray[Any, np.dtype[np.float64]]
HIDDEN, STEPS, RATE = 64, 2000, 3e-3


def train(states: Array, actions: Array, noise: float, path: Path) -> None:
    """Write a network in ONNX that gives for a state the action; both are rows x columns."""
    random = np.random.default_rng(0)
    centre, spread = states.mean(0), states.std(0) + 1e-3
    middle, reach = actions.mean(0), actions.std(0) + 1e-3
    wanted, width = (actions - middle) / reach, states.shape[1]
    layers = [random.normal(size=(width, HIDDEN)), random.normal(size=HIDDEN)]
    layers += [random.normal(size=(HIDDEN, HIDDEN)) / 8, np.zeros(HIDDEN)]
    layers += [np.zeros((HIDDEN, actions.shape[1])), np.zeros(actions.shape[1])]
    means, squares = ([np.zeros_like(layer) for layer in layers] for _ in range(2))
    for step in range(1, STEPS + 1):
        seen = (states + random.normal(size=states.shape) * noise - centre) / spread
        one = np.tanh(seen @ layers[0] + layers[1])
        two = np.tanh(one @ layers[2] + layers[3])
        wrong = 2 * (two @ layers[4] + layers[5] - wanted) / len(states)
        before = (wrong @ layers[4].T) * (1 - two**2)
        first = (before @ layers[2].T) * (1 - one**2)
        slopes = [seen.T @ first, first.sum(0), one.T @ before, before.sum(0), two.T @ wrong, wrong.sum(0)]
        for layer, slope, mean, square in zip(layers, slopes, means, squares, strict=True):
            mean += 0.1 * (slope - mean)
            square += 1e-3 * (slope**2 - square)
            layer -= RATE * (mean / (1 - 0.9**step)) / (np.sqrt(square / (1 - 0.999**step)) + 1e-8)
    layers[1] -= centre / spread @ layers[0]
    layers[0] /= spread[:, np.newaxis]
    layers[4] *= reach
    layers[5] = layers[5] * reach + middle
    _write(layers, path)


def _write(layers: list[Array], path: Path) -> None:
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    constants = [onnx.numpy_helper.from_array(layer.astype(np.float32), f"c{n}") for n, layer in enumerate(layers)]
    nodes, last = [], "seen"
    for turn in range(3):
        nodes.append(helper.make_node("MatMul", [last, f"c{2 * turn}"], [f"m{turn}"]))
        nodes.append(helper.make_node("Add", [f"m{turn}", f"c{2 * turn + 1}"], [f"a{turn}"]))
        last = f"a{turn}"
        if turn < 2:
            nodes.append(helper.make_node("Tanh", [last], [f"t{turn}"]))
            last = f"t{turn}"
    ends = [
        [helper.make_tensor_value_info(name, kind, [1, size])]
        for name, size in (("seen", layers[0].shape[0]), (last, layers[4].shape[1]))
    ]
    graph = helper.make_graph(nodes, "policy", *ends, constants)
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)])
    made.ir_version = 8
    onnx.save(made, str(path))
