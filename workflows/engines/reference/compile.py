"""How a bond's force becomes part of compiled loops, and how these are kept between processes."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from types import CellType, FunctionType
from typing import Any

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.reference.loops.cached_kernels import CachedKernel
from chaincor.workflows.engines.reference.loops.fingerprint import has_print

# Multiply-add may round once instead of twice; nothing else may be reordered, so that steps stay
# time-reversible to rounding.
FUSED = frozenset({"contract"})
# NumPy's division does not raise, which lets loops vectorise. What allocates nothing needs no count
# of references; what Python does not call, no wrappers.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
_OPTIONS |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}

# Forces of so many bonds are remembered, and their loops: named ones come back from disk.
KEPT = 64


@dataclass(frozen=True)
class ScalarForce:
    """A force that can be compiled."""

    function: Callable  #: -dU/dr of one strain, ``function(strain, parameters)``.
    parameters: tuple[float, ...]  #: What to call it with; NamedTuple.
    keep: bool  #: Whether loops around it may be kept on disk.


@lru_cache(maxsize=KEPT)
def scalar_force(bond: Potential) -> ScalarForce | None:
    """
    Return the force of a bond for compiled loops: its `force_kernel`, or its user's function.

    None where there is no function that compiles and then gives the same numbers.
    """
    if bond.force_kernel is not None:
        return ScalarForce(bond.force_kernel, bond.parameters, keep=True)
    users_force = bond.users_force
    if not isinstance(users_force, FunctionType):
        return None

    def function(strain: float, _parameters: tuple[float, ...]) -> float:
        return users_force(strain)

    function.__qualname__ = f"{users_force.__module__}.{users_force.__qualname__}"
    # What uses things of a user's that may change unseen is compiled each time.
    force = ScalarForce(function, bond.parameters, has_print(users_force))
    compiler = LoopCompiler.for_force(function, force.keep)
    known = compiler.register(function)

    def value(strain: float, parameters: tuple[float, ...]) -> float:
        # Loops need a number: np.where of a number, for one, is an array.
        return 1.0 * known(strain, parameters)

    single = compiler.compile(value)
    strains = np.linspace(-0.25, 0.25, 11)
    try:
        compiled = [single(strain, bond.parameters) for strain in strains.tolist()]
    except Exception:  # also whatever the function itself raises
        return None
    agrees = np.allclose(compiled, bond.force(strains), rtol=1e-12, atol=1e-15)
    return force if agrees else None


@dataclass(frozen=True)
class LoopCompiler:
    """
    Compiles loops whose inner functions are plain Python functions.

    Numba is imported when a loop must be compiled, and told then what was registered: plain
    copies, whose qualified names, of which symbols are made, are those of one potential alone.
    """

    #: Ends the qualified names of all functions compiled here; no two forces of ours share one.
    label: str
    keep: bool  #: Whether loops are kept on disk.
    _registered: list[tuple[FunctionType, dict]] = field(default_factory=list, init=False)
    _foreign: list[tuple[Callable, str]] = field(default_factory=list, init=False)

    @classmethod
    def for_force(cls, function: Callable, keep: bool, kind: str = "") -> "LoopCompiler":
        """Return the compiler for loops, of one of several kinds, around a force."""
        return cls(f"{function.__module__}.{function.__qualname__}{kind}", keep)

    def register(
        self, function: Callable, fastmath: frozenset[str] = FUSED, inline: bool = True
    ) -> Callable:
        """
        Make a function known to the compiler; it may close over registered functions.

        Returns a plain copy, to be called from compiled functions. LLVM's flags say how roundings
        may differ from what is written.
        """
        # A call that hands arrays over costs as much as a short loop. What works for so long that
        # calls cost nothing would, written out at each, take the compiler twice the time.
        own = self._own(function)
        self._registered.append((own, {"fastmath": set(fastmath), "forceinline": inline}))
        return own

    def register_foreign(self, name: str) -> Callable:
        """
        Make a function of another library, of that name, known: of addresses, and of no result.

        Returns what stands for it in functions to be compiled; `tell_address` is told where it is.
        """

        def foreign(*addresses: int) -> None:
            raise TypeError(f"{name} is for compiled code, and was called by Python")

        foreign.__qualname__ = f"{name}{self.label}"
        self._foreign.append((foreign, name))
        return foreign

    def compile(self, function: Callable, fastmath: frozenset[str] = FUSED) -> CachedKernel:
        """
        Compile a function that Python calls, at its first call, or load it.

        It closes over registered functions only; neither it nor these allocate anything. Other
        threads of Python run meanwhile.
        """
        own = self._own(function)

        def dispatcher() -> Any:
            from numba import njit

            self._tell_numba()
            # As what it calls, which would be compiled once more otherwise.
            return njit(own, forceinline=True, fastmath=set(fastmath), **_OPTIONS)

        return CachedKernel(own, dispatcher, self.keep)

    def _tell_numba(self) -> None:
        from numba.extending import overload, register_jitable

        _spare_linear_algebra()
        while self._registered:
            function, options = self._registered.pop(0)
            register_jitable(**_OPTIONS, **options)(function)
        while self._foreign:
            stand_in, name = self._foreign.pop(0)
            settings: Any = _OPTIONS | {"fastmath": set(FUSED)}
            overload(stand_in, jit_options=settings, strict=False)(_caller_of(name))

    def _own(self, function: Callable) -> FunctionType:
        assert isinstance(function, FunctionType)
        copy = FunctionType(
            function.__code__,
            function.__globals__,
            function.__name__,
            function.__defaults__,
            tuple(CellType(self._known(cell.cell_contents)) for cell in function.__closure__ or ()),
        )
        copy.__kwdefaults__ = function.__kwdefaults__
        copy.__qualname__ = f"{function.__qualname__.removesuffix(self.label)}{self.label}"
        return copy

    def _known(self, value: Any) -> Any:
        """Register what a force calls; what was registered here bears the label."""
        if not isinstance(value, FunctionType) or value.__qualname__.endswith(self.label):
            return value
        return self.register(value)


def _caller_of(name: str) -> Callable:
    """Return what tells Numba how a function of another library is called."""
    from numba import types

    def call(*addresses: Any) -> Callable:
        signature = types.void(*len(addresses) * (types.intp,))
        function = types.ExternalFunction(name, signature)
        return lambda *addresses: function(*addresses)

    return call


@lru_cache(maxsize=1)
def _spare_linear_algebra() -> None:
    """Keep Numba from loading SciPy's linear algebra, 0.15 s, only to see that it is there."""
    import numba.np.linalg as algebra

    look = getattr(algebra, "ensure_blas", None)
    if look is not None:
        algebra.ensure_blas = lambda: None
        try:
            import numba.np.arraymath  # noqa: F401
        finally:
            algebra.ensure_blas = look
