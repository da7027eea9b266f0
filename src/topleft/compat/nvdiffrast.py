"""Programs for nvdiffrast on the CPU as they are: `python -m topleft.compat nvdiffrast PROGRAM ...`.

`import nvdiffrast.torch` gives them `topleft.torch`. The CPU takes the place of a device "cuda": for tensors that are
made or moved there, `.cuda()`, and the calls of `torch.cuda` that wait, seed or empty. One line on stderr says so.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any

import torch
from torch.overrides import TorchFunctionMode

import topleft.torch

__all__ = ["install"]

#: Functions of `torch.cuda` that then do nothing.
WITHOUT_DEVICE = (
    "synchronize",
    "empty_cache",
    "manual_seed",
    "manual_seed_all",
    "set_device",
    "reset_peak_memory_stats",
)


def on_cpu(value: Any) -> Any:
    """Return an argument with the CPU for a device of CUDA."""
    if isinstance(value, torch.device) and value.type == "cuda":
        return torch.device("cpu")
    is_name = isinstance(value, str) and (value == "cuda" or value.startswith("cuda:"))
    return "cpu" if is_name else value


class OnCpu(TorchFunctionMode):  # type: ignore[misc]
    """While it is entered, functions of PyTorch take the CPU for a device of CUDA."""

    def __torch_function__(
        self, func: Callable[..., Any], types: Any, args: Sequence[Any] = (), kwargs: Mapping[str, Any] | None = None
    ) -> Any:
        """Call a function with the CPU."""
        if func is torch.Tensor.cuda:
            return args[0]
        return func(*map(on_cpu, args), **{name: on_cpu(value) for name, value in (kwargs or {}).items()})


def install() -> None:
    """Have `import nvdiffrast.torch` give `topleft.torch`, and PyTorch take the CPU for CUDA."""
    package = ModuleType("nvdiffrast")
    package.torch = topleft.torch  # type: ignore[attr-defined]
    sys.modules.update({"nvdiffrast": package, "nvdiffrast.torch": topleft.torch})
    for name in WITHOUT_DEVICE:
        setattr(torch.cuda, name, lambda *_, **__: None)
    torch.nn.Module.cuda = lambda module, device=None: module  # noqa: ARG005
    sys.stderr.write("topleft.compat: calls for 'cuda' run on the CPU\n")
    OnCpu().__enter__()
