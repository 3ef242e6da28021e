"""Compile loops with the force of a bond, and reuse them between processes."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from types import CellType, FunctionType
from typing import Any

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.reference.loops.cached_kernels import CachedKernel
from chaincor.workflows.engines.reference.loops.fingerprint import has_print
from chaincor.workflows.errors import CostError

# The compiler may fuse a multiplication and an addition, which then round once instead of twice. No
# other change of the arithmetic is allowed, because steps must stay time-reversible to rounding.
FUSED = frozenset({"contract"})
# With the error model of NumPy, divisions do not raise, and loops can be vectorised. The loops
# allocate nothing; therefore they need no reference counts. Python does not call them directly;
# therefore they need no wrappers.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
_OPTIONS |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}

# Forces and loops for this many bonds are cached in memory; loops for named bonds also on disk.
KEPT = 64


@dataclass(frozen=True)
class ScalarForce:
    """Force that can be compiled."""

    function: Callable  #: Force -dU/dr at one strain, ``function(strain, parameters)``.
    parameters: tuple[float, ...]  #: Parameters to pass to the function; NamedTuple.
    keep: bool  #: Whether loops with this force may be cached on disk.


@lru_cache(maxsize=KEPT)
def scalar_force(bond: Potential) -> ScalarForce | None:
    """
    Return the force of a bond for compiled loops: its `force_kernel` or `users_force`.

    Return None if no function compiles, or if the compiled function returns other forces.
    """
    if bond.force_kernel is not None:
        return ScalarForce(bond.force_kernel, bond.parameters, keep=True)
    users_force = bond.users_force
    if not isinstance(users_force, FunctionType):
        return None

    def function(strain: float, _parameters: tuple[float, ...]) -> float:
        return users_force(strain)

    function.__qualname__ = f"{users_force.__module__}.{users_force.__qualname__}"
    # If the function uses objects whose changes cannot be detected, it is compiled in each process.
    force = ScalarForce(function, bond.parameters, has_print(users_force))
    compiler = LoopCompiler.for_force(function, force.keep)
    known = compiler.register(function)

    def value(strain: float, parameters: tuple[float, ...]) -> float:
        # Loops need a scalar, but np.where, for example, returns an array even for a scalar.
        return 1.0 * known(strain, parameters)

    single = compiler.compile(value)
    strains = np.linspace(-0.25, 0.25, 11)
    try:
        compiled = [single(strain, bond.parameters) for strain in strains.tolist()]
    except CostError:  # the function is not at fault
        raise
    except Exception:  # includes any error that the function itself raises
        return None
    agrees = np.allclose(compiled, bond.force(strains), rtol=1e-12, atol=1e-15)
    return force if agrees else None


@dataclass(frozen=True)
class LoopCompiler:
    """
    Compiler for loops whose inner functions are plain Python functions.

    Numba is imported only if a loop must be compiled. It then receives plain copies of the
    registered functions. The qualified name of each copy is unique to one potential, because Numba
    derives symbols from qualified names.
    """

    #: Suffix of the qualified names of all functions compiled here; unique for each force.
    label: str
    keep: bool  #: Whether loops are cached on disk.
    _registered: list[tuple[FunctionType, dict]] = field(default_factory=list, init=False)
    _foreign: list[tuple[Callable, str]] = field(default_factory=list, init=False)

    @classmethod
    def for_force(cls, function: Callable, keep: bool, kind: str = "") -> "LoopCompiler":
        """Return the compiler for one kind of loops with a force."""
        return cls(f"{function.__module__}.{function.__qualname__}{kind}", keep)

    def register(
        self, function: Callable, fastmath: frozenset[str] = FUSED, inline: bool = True
    ) -> Callable:
        """
        Register a function, which may call registered functions from its closure.

        Return a plain copy that compiled functions can call. The LLVM flags `fastmath` state how
        the arithmetic may differ from the written order.
        """
        # Functions are inlined, because a call that passes arrays takes as long as a short loop.
        # For long functions the time of a call is negligible, and inlining would double the compile
        # time.
        own = self._own(function)
        self._registered.append((own, {"fastmath": set(fastmath), "forceinline": inline}))
        return own

    def register_foreign(self, name: str) -> Callable:
        """
        Register a function of another library, which takes addresses and returns nothing.

        Return a stand-in for the foreign function, which compiled code can call. Its
        address is set by `set_symbol_address`.
        """

        def foreign(*addresses: int) -> None:
            raise TypeError(f"{name} is for compiled code, and was called by Python")

        foreign.__qualname__ = f"{name}{self.label}"
        self._foreign.append((foreign, name))
        return foreign

    def compile(self, function: Callable, fastmath: frozenset[str] = FUSED) -> CachedKernel:
        """
        Return a kernel that is compiled or loaded at its first call from Python.

        The closure of `function` may contain only registered functions, and no function may
        allocate memory. The kernel releases Python's global interpreter lock.
        """
        own = self._own(function)

        def dispatcher() -> Any:
            from numba import njit

            self._hand_to_numba()
            # These are also the options of the inner functions. With other options, Numba would
            # compile the inner functions once more.
            return njit(own, forceinline=True, fastmath=set(fastmath), **_OPTIONS)

        return CachedKernel(own, dispatcher, self.keep)

    def _hand_to_numba(self) -> None:
        from numba.extending import overload, register_jitable

        _spare_linear_algebra()
        # Remove a function only after its registration, so that an interrupted registration is
        # repeated.
        while self._registered:
            function, options = self._registered[0]
            register_jitable(**_OPTIONS, **options)(function)
            del self._registered[0]
        while self._foreign:
            stand_in, name = self._foreign[0]
            settings: Any = _OPTIONS | {"fastmath": set(FUSED)}
            overload(stand_in, jit_options=settings, strict=False)(_caller_of(name))
            del self._foreign[0]

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
        """Return a registered copy of a plain function; return any other value unchanged."""
        if not isinstance(value, FunctionType) or value.__qualname__.endswith(self.label):
            return value
        return self.register(value)


def _caller_of(name: str) -> Callable:
    """Return a function that tells Numba how to call a function of another library."""
    from numba import types

    def call(*addresses: Any) -> Callable:
        signature = types.void(*len(addresses) * (types.intp,))
        function = types.ExternalFunction(name, signature)
        return lambda *addresses: function(*addresses)

    return call


@lru_cache(maxsize=1)
def _spare_linear_algebra() -> None:
    """Prevent Numba from importing SciPy's linear algebra, which takes 0.15 s."""
    import numba.np.linalg as algebra

    look = getattr(algebra, "ensure_blas", None)
    if look is not None:
        algebra.ensure_blas = lambda: None
        try:
            import numba.np.arraymath  # noqa: F401
        finally:
            algebra.ensure_blas = look
