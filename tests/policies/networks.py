"""Networks for policies that tests make: each answers with a matrix times its observation, plus numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

onnx = pytest.importorskip("onnx", reason="onnx is not installed")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")


def network(path: Path, matrix: Any, plus: Any, *, is_batch: bool = True, inputs: int = 1) -> Path:
    """Write a network that takes as many numbers as the matrix has rows, and gives as many as it has columns."""
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    matrix, plus = np.asarray(matrix, np.float32), np.asarray(plus, np.float32)
    constants = [onnx.numpy_helper.from_array(matrix, "matrix"), onnx.numpy_helper.from_array(plus, "plus")]
    nodes = [
        helper.make_node("MatMul", ["seen0", "matrix"], ["product"]),
        helper.make_node("Add", ["product", "plus"], ["answer"]),
    ]
    first: list[Any] = [1] if is_batch else []
    seen = [helper.make_tensor_value_info(f"seen{n}", kind, [*first, matrix.shape[0]]) for n in range(inputs)]
    answer = helper.make_tensor_value_info("answer", kind, [*first, matrix.shape[1]])
    made = helper.make_model(
        helper.make_graph(nodes, "policy", seen, [answer], constants), opset_imports=[helper.make_opsetid("", 13)]
    )
    made.ir_version = 8
    onnx.save(made, str(path))
    return path
