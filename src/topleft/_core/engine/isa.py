"""Choose the kernels at import: of the widest instruction set that runs here, or of the set in ``TOPLEFT_ISA``."""

import os
from typing import Any

from topleft._core.engine import kernels

NAMES = ("scalar", "simd128", "avx2", "avx512")


def select() -> str:
    """Return the instruction set in use: ``TOPLEFT_ISA`` if it is set, else the widest that was built and can run here.

    A `ValueError` when ``TOPLEFT_ISA`` names a set that does not exist, was not built, or cannot run here.
    """
    available = kernels.isa_available()
    name = os.environ.get("TOPLEFT_ISA", "").strip().lower()
    if not name:
        return available[-1]
    if name in available:
        return name
    if name not in NAMES:
        reason = "which is no instruction set that topleft knows"
    elif name not in kernels.isa_built():
        reason = "which was not built"
    else:
        reason = "which this machine cannot run"
    raise ValueError(f"TOPLEFT_ISA must be one of {', '.join(available)}, got {name!r}, {reason}")


def build_info() -> dict[str, Any]:
    """Return how this copy of topleft was built, and its kernels and processor.

    Returns
    -------
    dict
        ``version``; ``compiler``; ``flags``, the compiler flags of each kernel unit; ``isa_built``, the instruction
        sets in the binary; ``isa_available``, those that this machine can run; ``isa_missing``, wider sets that it
        can run and that the binary lacks; ``isa``, the set in use. All instruction sets compute equal bits.

    Examples
    --------
    >>> import topleft as tl
    >>> info = tl.build_info()
    >>> "scalar" in info["isa_built"], info["isa"] in info["isa_available"]
    (True, True)
    """
    return {
        **kernels.compiler_info(),
        "isa_built": kernels.isa_built(),
        "isa_available": kernels.isa_available(),
        "isa_missing": kernels.isa_missing(),
        "isa": kernels.isa_in_use(),
    }


kernels.use_isa(select())
