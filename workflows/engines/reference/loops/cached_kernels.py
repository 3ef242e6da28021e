"""
Compiled loops that are cached on disk as object code and run without Numba.

Importing Numba and loading a loop from its own cache takes longer than most collisions. The object
code that LLVM makes from Numba's output is therefore kept in one file and called by its address.
Code that was just compiled is the same as loaded code, and so are its numbers.
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
from chaincor.workflows.engines.reference.loops.processes import a_loop_is_compiled, one_process
from chaincor.workflows.engines.time_limit import stopped_at_limit

# NumPy's flags that decide how compiled code reads an array: contiguous, aligned, writeable.
_LAYOUT = 0x0001 | 0x0100 | 0x0400
_CTYPES = {"integer": ctypes.c_int64, "real": ctypes.c_double, "flag": ctypes.c_uint8}
_RETURNED: dict[str, Any] = {"int64": ctypes.c_int64, "float64": ctypes.c_double, "none": None}
# Functions compiled by Numba have these statuses if they return a value, or None.
_RETURNED_ONE, _RETURNED_NONE = 0, -2
# Prefixes of symbols whose addresses only Numba knows.
_NUMBAS_OWN = ("NRT_", "numba_", "Py", "_Py")

_LOCK = threading.RLock()


class ObjectCode(NamedTuple):
    """Compiled loop as object code."""

    code: bytes  #: Object file.
    symbol: str  #: Symbol of the function.
    returns: str  #: Type of the result: ``int64``, ``float64`` or ``none``.
    #: External functions that the loop calls: from the mathematical library, or from
    #: `tell_address`.
    needs: list[str]


class CachedKernel:
    """
    Loop that is compiled at its first call, or loaded if it was compiled before.

    `function` is plain Python that allocates nothing and calls only functions known to the
    compiler. `dispatcher` returns the loop as Numba's dispatcher; it is called only if the loop
    must be compiled.
    """

    def __init__(self, function: FunctionType, dispatcher: Callable[[], Any], keep: bool) -> None:
        self._function, self._dispatcher, self._keep = function, dispatcher, keep
        self._binds: dict[tuple, Callable] = {}
        self.compiled = 0  # number of compilations in this process, one for each kind of arguments

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
            # The file name does not depend on the code, so a new version overwrites a stale one.
            place = _digest(repr(kinds), _machine_print(), *self._called())
            path = folder_of_loops() / f"{name}-{place[:16]}.loop"
            key = _digest(place, fingerprint(self._function))
            found = _read(path, key)
            if found is None:
                with a_loop_is_compiled(), one_process(path.parent, path.name):
                    found = _read(path, key)  # another process may have compiled the loop
                    if found is None:
                        found = self._compile(arguments)
                        _write(path, key, found)
            return _loaded(found, kinds)

    def _called(self) -> list[str]:
        """Return the names of the called functions, which distinguish loops of one name."""
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
        with stopped_at_limit():
            loop = self._dispatcher()
            types = tuple(map(numba.typeof, arguments))
            loop.compile(types)
            made = loop.overloads[types]
            module = llvm.parse_assembly(loop.inspect_llvm(types))
        entry = module.get_function(made.fndesc.llvm_func_name)
        needs = []
        for value in (*module.functions, *module.global_variables):
            if not value.is_declaration:
                # Exported symbols of the same name would be shared between loops.
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
    """Append the kind of each argument, and the values that compiled code receives for it."""
    for argument in arguments:
        if isinstance(argument, np.ndarray):
            kinds.append((argument.dtype.str, argument.ndim, argument.flags.num & _LAYOUT))
            # This is Numba's form of an array; the two zeros leave out the owner and its reference
            # count.
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
    """Return the address of an array, four times as fast as ``array.ctypes.data``; 0 if empty."""
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
    # The first two arguments point to the result and to an exception, which no loop raises.
    prototype = ctypes.CFUNCTYPE(
        ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *_argument_types(kinds)
    )
    function, returned = prototype(address), _RETURNED[made.returns]

    def bind(values: list, arguments: tuple) -> Callable[[], Any]:
        result, exception = (returned or ctypes.c_int64)(), ctypes.c_void_p()
        whole = (ctypes.addressof(result), ctypes.addressof(exception), *values)

        # The default argument keeps code and arrays alive as long as the function.
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
    """Return LLVM's code generator with the settings of Numba."""
    import llvmlite.binding as llvm

    _start_llvm()
    target = llvm.Target.from_default_triple()
    reloc = "static" if target.name.startswith("x86") else "default"
    return target.create_target_machine(reloc=reloc, codemodel="jitdefault", jit=True, **options)


@lru_cache(maxsize=1)
def _machine_print() -> str:
    """Return all settings on which compiled code depends besides its source."""
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
    """Return the folder of cached loops: beside their source if possible, as Numba chooses it."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given)
    beside = Path(__file__).parent / "__pycache__"
    if os.access(beside if beside.exists() else beside.parent, os.W_OK):
        return beside
    from platformdirs import user_cache_path

    return user_cache_path("chaincor")


def _read(path: Path, key: str) -> ObjectCode | None:
    """Return the compiled loop in a file; None if the file is damaged or stale."""
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


def tell_address(name: str, function: Any) -> None:
    """Set the address of a function of another library, before a loop that calls it is compiled."""
    import llvmlite.binding as llvm

    llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)


def _is_known(name: str) -> bool:
    """Return whether LLVM knows, or can be given, the address of a mathematical function."""
    import llvmlite.binding as llvm

    if llvm.address_of_symbol(name) is not None:
        return True
    # The `math` module links this library, or the program itself does if `math` is built in.
    function = getattr(ctypes.CDLL(getattr(math, "__file__", None)), name, None)
    if function is not None:
        tell_address(name, function)
    return function is not None


def _write(path: Path, key: str, made: ObjectCode) -> None:
    """Write a loop for other processes, which read either the old file or the new one."""
    facts = {"key": key, "symbol": made.symbol, "returns": made.returns, "needs": made.needs}
    content = json.dumps(facts).encode() + b"\n" + made.code
    part = path.with_suffix(f".{os.getpid()}")
    # A full or read-only disk only costs the next process time.
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            # The first line is the checksum of the rest: a damaged symbol would crash the process.
            part.write_bytes(sha256(content).hexdigest().encode() + b"\n" + content)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
