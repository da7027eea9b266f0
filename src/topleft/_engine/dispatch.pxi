# The kernel table in use, and what can be asked about the build. Included by _engine.pyx, which declares `tl_kernels`.

cdef extern from "dispatch.h" nogil:
    enum:
        TL_N_ISA
    const char *tl_isa_name(int i_isa)
    bint tl_isa_built(int i_isa)
    bint tl_isa_available(int i_isa)
    const char *tl_isa_flags(int i_isa)
    const tl_kernels *tl_kernels_for(const char *name)
    const char *tl_compiler()
    const char *tl_version()

# The kernels in use. Scalar until `_isa.py` has chosen: never NULL.
cdef const tl_kernels *K = tl_kernels_for(b"scalar")
cdef str isa_name = "scalar"


def use_isa(name: str) -> None:
    """Let all further calls run on the kernels of one available instruction set."""
    global K, isa_name
    cdef bytes key = name.encode()
    cdef const tl_kernels *kernels = tl_kernels_for(key)
    if kernels == NULL:
        raise ValueError(f"instruction set must be one of {', '.join(isa_available())}, got {name!r}")
    K = kernels
    isa_name = name


def isa_in_use() -> str:
    """Return the name of the instruction set that the kernels in use were compiled for."""
    return isa_name


def isa_built() -> list[str]:
    """Return the instruction sets in this binary, the plainest first."""
    return [tl_isa_name(i).decode() for i in range(TL_N_ISA) if tl_isa_built(i)]


def isa_available() -> list[str]:
    """Return the instruction sets in this binary that this machine can run, the plainest first."""
    return [tl_isa_name(i).decode() for i in range(TL_N_ISA) if tl_isa_available(i)]


def compiler_info() -> dict[str, object]:
    """Return what this binary was made from and how: version, compiler, flags of each unit."""
    return {
        "version": tl_version().decode(),
        "compiler": tl_compiler().decode().strip(),
        "flags": {tl_isa_name(i).decode(): tl_isa_flags(i).decode() for i in range(TL_N_ISA) if tl_isa_built(i)},
    }
