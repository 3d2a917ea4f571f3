"""An identified joint as an ONNX graph: input `states` (n, 2 k), output `forces` (n, k), double precision, SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.errors import MissingPackageError
from bench.joint_export.polynomial_terms import terms_of
from bench.joint_models.document import JointFile
from bench.nastran import network_weights


@dataclass(frozen=True)
class OnnxGraphSettings:
    """Numbers of `bench.joint_export.onnx_graph`."""

    opset: int = 17
    """Version of the operators; all that are used here are older."""


SETTINGS = OnnxGraphSettings()


def onnx_bytes(joint: JointFile) -> bytes:
    """The graph, serialised.

    Raises:
        MissingPackageError: The package `onnx` is not installed.
        ParameterError: The joint has a memory.
    """
    try:
        import onnx  # noqa: PLC0415  (of the extra `onnx`)
        from onnx import TensorProto, helper, numpy_helper  # noqa: PLC0415
    except ImportError:
        raise MissingPackageError("ONNX needs the package onnx: pip install 'jointbench[onnx]'") from None
    own = joint.element
    graph = _Graph(helper)
    if own.law.name == "network":
        weights = network_weights(own)
        hidden = graph.add("Add", graph.add("MatMul", "states", graph.constant(weights.W1.T)), graph.constant(weights.b1))  # fmt: skip
        product = graph.add("MatMul", graph.add("Tanh", hidden), graph.constant(weights.W2.T))
        graph.add("Add", product, graph.constant(weights.b2), out="forces")
    else:
        _polynomial(graph, joint)
    k = len(own.joints)
    made = helper.make_graph(
        graph.nodes,
        own.name,
        [helper.make_tensor_value_info("states", TensorProto.DOUBLE, ["n", 2 * k])],
        [helper.make_tensor_value_info("forces", TensorProto.DOUBLE, ["n", k])],
        [numpy_helper.from_array(value, name) for name, value in graph.constants.items()],
    )
    model = helper.make_model(
        made,
        opset_imports=[helper.make_opsetid("", SETTINGS.opset)],
        producer_name="jointbench",
        ir_version=8,
    )
    onnx.checker.check_model(model)
    return model.SerializeToString()


class _Graph:
    """Nodes and constants while a graph is made."""

    def __init__(self, helper: Any) -> None:
        self.helper = helper
        self.nodes: list[Any] = []
        self.constants: dict[str, NDArray] = {}

    def constant(self, value: NDArray, kind: type = np.float64) -> str:
        name = f"c{len(self.constants)}"
        self.constants[name] = np.ascontiguousarray(value, dtype=kind)
        return name

    def add(self, operator: str, *inputs: str, out: str = "", **attributes: Any) -> str:
        name = out or f"t{len(self.nodes)}"
        self.nodes.append(self.helper.make_node(operator, list(inputs), [name], **attributes))
        return name


def _polynomial(graph: _Graph, joint: JointFile) -> None:
    """Tables of the one-state polynomials by recurrence, then a product of one entry of each for every term."""
    terms = terms_of(joint.element)
    u = graph.add("Div", graph.add("Sub", "states", graph.constant(terms.centre)), graph.constant(terms.scale))  # fmt: skip
    rows = [graph.add("Sub", u, u), u]
    rows[0] = graph.add("Add", rows[0], graph.constant(np.ones(1)))
    twice = graph.add("Mul", u, graph.constant(np.array([2.0 if terms.chebyshev else 1.0])))
    while len(rows) <= int(terms.exponents.max()):
        following = graph.add("Mul", twice, rows[-1])
        rows.append(graph.add("Sub", following, rows[-2]) if terms.chebyshev else following)
    table = graph.add("Concat", *rows, axis=1)  # (n, orders * states)
    n_states = terms.exponents.shape[1]
    product = ""
    for i in range(n_states):
        column = graph.add(
            "Gather", table, graph.constant(terms.exponents[:, i] * n_states + i, np.int64), axis=1
        )
        product = graph.add("Mul", product, column) if product else column
    graph.add("MatMul", product, graph.constant(terms.coefficients.T), out="forces")
