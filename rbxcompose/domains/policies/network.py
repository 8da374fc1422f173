"""The network of a policy: a file in ONNX that makes one vector of another."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rbxcompose.base.files import NotRegularError, TooLargeError, read_regular

LARGEST = 512 * 1024 * 1024  # [B]


class PolicyNetworkError(ValueError):
    """Raised for a file that is no network of a policy, and for one that fails."""


class PolicyNetwork:
    """A network with one vector as its input, and one as its first output: both of the shape N or 1xN, of floats."""

    def __init__(self, path: Path, threads: int = 1) -> None:
        """Load it.

        Raises:
            PolicyNetworkError: if the file is no such network.
        """
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
        options.log_severity_level = 4  # what goes wrong is raised
        data = read_network(path)
        try:
            self._session: Any = onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # its errors have no common class
            raise PolicyNetworkError(f"'{path.name}' is no network in ONNX: {_first_line(error)}") from error
        inputs, outputs = self._session.get_inputs(), self._session.get_outputs()
        if len(inputs) != 1:
            raise PolicyNetworkError(f"it has {len(inputs)} inputs, and not one vector")
        self._input, self._output = inputs[0].name, outputs[0].name
        self._is_batch = len(inputs[0].shape) == 2
        self.takes = _length(inputs[0], "input")
        """How many numbers it takes; None if it does not say."""
        self.gives = _length(outputs[0], "output")
        """How many numbers it gives; None if it does not say."""

    def answer(self, vector: Sequence[float]) -> list[float]:
        """Return its answer to an observation.

        Raises:
            PolicyNetworkError: if it cannot be computed.
        """
        import numpy as np

        given = np.asarray([vector] if self._is_batch else vector, np.float32)
        try:
            found = self._session.run([self._output], {self._input: given})[0]
        except Exception as error:  # its errors have no common class
            raise PolicyNetworkError(f"the network fails: {_first_line(error)}") from error
        return [float(value) for value in np.ravel(found)]


def read_network(path: Path) -> bytes:
    """Return the contents of a file.

    Raises:
        PolicyNetworkError: if there is none, or it cannot be read.
    """
    try:
        return read_regular(path, LARGEST)
    except FileNotFoundError:
        raise PolicyNetworkError(f"there is no file '{path}'") from None
    except (NotRegularError, TooLargeError) as error:
        raise PolicyNetworkError(f"'{path.name}' cannot be used: {error}") from None
    except OSError as error:
        raise PolicyNetworkError(f"'{path.name}' cannot be read: {error.strerror}") from None


def _length(end: Any, what: str) -> int | None:
    shape = end.shape
    is_vector = len(shape) == 1 or (len(shape) == 2 and (shape[0] == 1 or not isinstance(shape[0], int)))
    if end.type != "tensor(float)" or not is_vector:
        written = "x".join(map(str, shape)) or "nothing"
        raise PolicyNetworkError(
            f"its {what} '{end.name}' is {end.type} of the shape {written}, and not floats N or 1xN"
        )
    return shape[-1] if isinstance(shape[-1], int) else None


def _first_line(error: Exception) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)[:120]
