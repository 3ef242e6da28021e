"""
Compiled loops that are cached on disk as object code and run without Numba.

Importing Numba and loading a loop from Numba's own cache takes longer than most collisions.
Therefore the object code that LLVM makes from Numba's output is cached in a file and called by its
address. Freshly compiled code is loaded from the same object code; its results are the same.
"""

import ctypes
import json
import math
import os
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.reference.loops.fingerprint import fingerprint
from chaincor.workflows.engines.reference.loops.processes import compiling_loop, one_process
from chaincor.workflows.engines.time_limit import compiling_to_limit

# These flags of NumPy arrays affect compiled code: contiguous, aligned, writeable.
_LAYOUT = 0x0001 | 0x0100 | 0x0400
_CTYPES = {"integer": ctypes.c_int64, "real": ctypes.c_double, "flag": ctypes.c_uint8}
_RETURNED: dict[str, Any] = {"int64": ctypes.c_int64, "float64": ctypes.c_double, "none": None}
# A function compiled by Numba returns one of these statuses if its result is a value or None.
_RETURNED_ONE, _RETURNED_NONE = 0, -2
# Prefixes of symbols whose addresses only Numba knows.
_NUMBAS_OWN = ("NRT_", "numba_", "Py", "_Py")

_LOCK = threading.RLock()


class ObjectCode(NamedTuple):
    """Compiled loop as object code."""

    code: bytes  #: Object file.
    symbol: str  #: Symbol of the function.
    returns: str  #: Type of the result: ``int64``, ``float64`` or ``none``.
    #: Names of external functions that the loop calls. They are in the mathematical library or
    #: known from `set_symbol_address`.
    needs: list[str]


class CachedKernel:
    """
    Loop that is compiled, or loaded from the cache, at its first call.

    `function` is plain Python that allocates nothing and calls only functions registered with the
    compiler. `dispatcher` returns Numba's dispatcher of the loop; it is called only if the loop
    must be compiled.
    """

    def __init__(self, function: FunctionType, dispatcher: Callable[[], Any], keep: bool) -> None:
        self._function, self._dispatcher, self._keep = function, dispatcher, keep
        self._binds: dict[tuple, Callable] = {}
        self.compiled = 0  # compilations in this process, one per combination of argument types

    def __call__(self, *arguments: Any) -> Any:
        """Run the loop; arguments are numbers, arrays, records, or tuples of these."""
        return self.bound(*arguments)()

    def bound(self, *arguments: Any) -> Callable[[], Any]:
        """Return a function without arguments that runs the loop with these arguments."""
        kinds: list[Any] = []
        values: list[Any] = []
        _take_apart(arguments, kinds, values)
        key = tuple(kinds)
        bind = self._binds.get(key)
        if bind is None:
            bind = self._binds[key] = self._prepare(key, arguments)
        return bind(values, arguments)

    def _prepare(self, kinds: tuple, arguments: tuple) -> Callable:
        with _LOCK:
            if not self._keep:
                return _loaded(self._compile(arguments), kinds)
            name = self._function.__qualname__.replace("<locals>", "").replace("..", ".")
            name = name.replace("<lambda>", "lambda")
            # The file name does not depend on the code of the loop; therefore a new version
            # overwrites a stale one.
            place = _digest(repr(kinds), _machine_print(), *self._called())
            path = folder_of_loops() / f"{name}-{place[:16]}.loop"
            key = _digest(place, fingerprint(self._function))
            found = _read(path, key)
            if found is None:
                with compiling_loop(), one_process(path.parent, path.name):
                    found = _read(path, key)  # another process may have compiled the loop
                    if found is None:
                        found = self._compile(arguments)
                        _write(path, key, found)
            return _loaded(found, kinds)

    def _called(self) -> list[str]:
        """Return the names of called functions; they distinguish loops with the same name."""
        used = (cell.cell_contents for cell in self._function.__closure__ or ())
        return sorted(each.__qualname__ for each in used if isinstance(each, FunctionType))

    def _compile(self, arguments: tuple) -> ObjectCode:
        import llvmlite.binding as llvm
        import numba
        from numba.core import codegen
        from numba.core import config as settings

        config: Any = settings
        if config.DISABLE_JIT:
            raise InputError(
                "NUMBA_DISABLE_JIT is set in the environment, and loops are not compiled yet. "
                "Unset it"
            )
        self.compiled += 1
        with compiling_to_limit():
            loop = self._dispatcher()
            types = tuple(map(numba.typeof, arguments))
            loop.compile(types)
            made = loop.overloads[types]
            module = llvm.parse_assembly(loop.inspect_llvm(types))
        entry = module.get_function(made.fndesc.llvm_func_name)
        needs = []
        for value in (*module.functions, *module.global_variables):
            if not value.is_declaration:
                # Without internal linkage, loops would export symbols of the same name.
                value.linkage = "internal" if value.name != entry.name else "external"
            elif value.name.startswith(_NUMBAS_OWN):
                raise TypeError(f"{self._function.__qualname__} needs {value.name} of Numba")
            elif not value.name.startswith("llvm."):
                needs.append(value.name)
        features = config.CPU_FEATURES
        machine = _target_machine(
            opt=int(config.OPT),
            cpu=config.CPU_NAME or llvm.get_host_cpu_name(),
            features=codegen.get_host_cpu_features() if features is None else features,
        )
        returns = str(made.signature.return_type)
        return ObjectCode(machine.emit_object(module), entry.name, returns, needs)


def _digest(*parts: str) -> str:
    return sha256("\n".join(parts).encode()).hexdigest()


def _take_apart(arguments: tuple, kinds: list, values: list) -> None:
    """Append the type of each argument, and the values that represent it in compiled code."""
    for argument in arguments:
        if isinstance(argument, np.ndarray):
            kinds.append((argument.dtype.str, argument.ndim, argument.flags.num & _LAYOUT))
            # Numba represents an array by these values; the two zeros stand for a missing owner and
            # its reference count.
            values += (0, 0, argument.size, argument.itemsize, _address(argument))
            values += argument.shape
            values += argument.strides
        elif isinstance(argument, tuple):
            kinds += (type(argument), len(argument))
            _take_apart(argument, kinds, values)
        elif isinstance(argument, float):
            kinds.append("real")
            values.append(argument)
        elif isinstance(argument, bool | np.bool_):
            kinds.append("flag")
            values.append(argument)
        elif isinstance(argument, int | np.int64):
            kinds.append("integer")
            values.append(int(argument))
        elif isinstance(argument, np.void):
            kinds.append(argument.dtype)
            values.append(np.frombuffer(argument, np.uint8).ctypes.data)
        else:
            raise TypeError(
                f"a compiled loop cannot take {argument!r}. Give numbers, arrays or records"
            )


def _address(array: Any) -> int:
    """Return the address of an array; 0 if empty. Four times as fast as ``array.ctypes.data``."""
    if array.size == 0:
        return 0
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError, BufferError):  # the array is read-only or not contiguous
        return array.ctypes.data


def _argument_types(kinds: tuple) -> list:
    """Return the C types of the values from `_take_apart`."""
    types: list[Any] = []
    for kind in kinds:
        if isinstance(kind, str):
            types.append(_CTYPES[kind])
        elif isinstance(kind, np.dtype):
            types.append(ctypes.c_void_p)
        elif isinstance(kind, tuple):
            pointer, count = ctypes.c_void_p, ctypes.c_int64
            types += (pointer, pointer, count, count, pointer, *2 * kind[1] * (count,))
    return types


def _loaded(made: ObjectCode, kinds: tuple) -> Callable:
    """Return a function that binds compiled code to the values from `_take_apart`."""
    import llvmlite.binding as llvm

    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(made.code))
    engine.finalize_object()
    address = engine.get_function_address(made.symbol)
    # The first two arguments are pointers to the result and to an exception; no loop raises an
    # exception.
    prototype = ctypes.CFUNCTYPE(
        ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *_argument_types(kinds)
    )
    function, returned = prototype(address), _RETURNED[made.returns]

    def bind(values: list, arguments: tuple) -> Callable[[], Any]:
        result, exception = (returned or ctypes.c_int64)(), ctypes.c_void_p()
        whole = (ctypes.addressof(result), ctypes.addressof(exception), *values)

        # The default argument keeps the code and the arrays alive as long as the function exists.
        def run(_kept: Any = (engine, exception, arguments)) -> Any:
            status = function(*whole)
            if status not in (_RETURNED_ONE, _RETURNED_NONE):
                raise RuntimeError(f"the compiled loop {made.symbol} failed with status {status}")
            return None if returned is None else result.value

        return run

    return bind


@lru_cache(maxsize=1)
def _start_llvm() -> None:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


def _target_machine(**options: Any) -> Any:
    """Return a code generator of LLVM with the settings that Numba uses."""
    import llvmlite.binding as llvm

    _start_llvm()
    target = llvm.Target.from_default_triple()
    reloc = "static" if target.name.startswith("x86") else "default"
    return target.create_target_machine(reloc=reloc, codemodel="jitdefault", jit=True, **options)


@lru_cache(maxsize=1)
def _machine_print() -> str:
    """Return a text of all settings that affect compiled code, apart from its source."""
    import llvmlite.binding as llvm

    _start_llvm()
    settings = {
        name: value
        for name, value in sorted(os.environ.items())
        if name.startswith("NUMBA_") and name != "NUMBA_CACHE_DIR"
    }
    versions = {name: version(name) for name in ("numba", "llvmlite", "numpy")}
    processor = (llvm.get_process_triple(), llvm.get_host_cpu_name())
    return repr((versions, processor, llvm.get_host_cpu_features().flatten(), settings))


def folder_of_loops() -> Path:
    """Return the folder of cached loops, chosen as Numba does: beside the source if possible."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given)
    beside = Path(__file__).parent / "__pycache__"
    if os.access(beside if beside.exists() else beside.parent, os.W_OK):
        return beside
    from platformdirs import user_cache_path

    return user_cache_path("chaincor")


def _read(path: Path, key: str) -> ObjectCode | None:
    """Return the compiled loop from a file; None if the file is missing, damaged or stale."""
    try:
        digest, content = path.read_bytes().split(b"\n", 1)
        if digest != sha256(content).hexdigest().encode():
            return None
        head, code = content.split(b"\n", 1)
        facts = json.loads(head)
        made = ObjectCode(code, facts["symbol"], facts["returns"], facts["needs"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return made if facts["key"] == key and all(map(_is_known, made.needs)) else None


def set_symbol_address(name: str, function: Any) -> None:
    """Set the address of a foreign function, before a loop that calls it is compiled or loaded."""
    import llvmlite.binding as llvm

    llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)


def _is_known(name: str) -> bool:
    """Return whether LLVM knows a mathematical function; set its address if necessary."""
    import llvmlite.binding as llvm

    if llvm.address_of_symbol(name) is not None:
        return True
    # The `math` module is linked to the mathematical library; if `math` is built in, the program
    # itself is.
    function = getattr(ctypes.CDLL(getattr(math, "__file__", None)), name, None)
    if function is not None:
        set_symbol_address(name, function)
    return function is not None


def _write(path: Path, key: str, made: ObjectCode) -> None:
    """Write a loop to a file; other processes read either the complete old or new file."""
    facts = {"key": key, "symbol": made.symbol, "returns": made.returns, "needs": made.needs}
    content = json.dumps(facts).encode() + b"\n" + made.code
    part = path.with_suffix(f".{os.getpid()}")
    # If the disk is full or read-only, the next process only has to compile the loop again.
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            # The first line is the checksum of the rest, because a damaged file would crash the
            # process.
            part.write_bytes(sha256(content).hexdigest().encode() + b"\n" + content)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
