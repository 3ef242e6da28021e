"""
Compiled loops that are kept on disk as object code, and run without Numba.

To import Numba and to have it load a loop from its own cache takes longer than most collisions. So
what it made of a loop is kept as LLVM translates it, in one file, and called by its address. The
code is the same when it was just compiled and when it was loaded, and so are its numbers.
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

# NumPy's flags that decide how compiled code reads an array: contiguous, aligned, writeable.
_LAYOUT = 0x0001 | 0x0100 | 0x0400
_CTYPES = {"integer": ctypes.c_int64, "real": ctypes.c_double, "flag": ctypes.c_uint8}
_RETURNED: dict[str, Any] = {"int64": ctypes.c_int64, "float64": ctypes.c_double, "none": None}
# How functions compiled by Numba say that they returned a value, or None.
_RETURNED_ONE, _RETURNED_NONE = 0, -2
# Of these, only Numba itself knows where they are.
_NUMBAS_OWN = ("NRT_", "numba_", "Py", "_Py")

_LOCK = threading.RLock()


class ObjectCode(NamedTuple):
    """A compiled loop."""

    code: bytes  #: An object file.
    symbol: str  #: Its function.
    returns: str  #: What that returns: ``int64``, ``float64`` or ``none``.
    #: Functions that it calls: of the mathematical library, and those of `tell_address`.
    needs: list[str]


class CachedKernel:
    """
    A loop that is compiled at its first call, or loaded where it has been compiled before.

    The function is plain Python that allocates nothing; what it calls is known to the compiler. The
    dispatcher returns the loop as Numba knows it, and is called only where it must be compiled.
    """

    def __init__(self, function: FunctionType, dispatcher: Callable[[], Any], keep: bool) -> None:
        self._function, self._dispatcher, self._keep = function, dispatcher, keep
        self._binds: dict[tuple, Callable] = {}
        self.compiled = 0  # how often in this process, for arguments of how many kinds

    def __call__(self, *arguments: Any) -> Any:
        """Run it; arguments are numbers, arrays, records and tuples of those."""
        return self.bound(*arguments)()

    def bound(self, *arguments: Any) -> Callable[[], Any]:
        """Return what runs it with these arguments, as they are then."""
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
            # Of one place, so that what has become stale is written over.
            place = _digest(repr(kinds), _machine_print(), *self._called())
            path = folder_of_loops() / f"{name}-{place[:16]}.loop"
            key = _digest(place, fingerprint(self._function))
            found = _read(path, key)
            if found is None:
                with a_loop_is_compiled(), one_process(path.parent, path.name):
                    found = _read(path, key)  # another process may have compiled it
                    if found is None:
                        found = self._compile(arguments)
                        _write(path, key, found)
            return _loaded(found, kinds)

    def _called(self) -> list[str]:
        """Return the names of what it calls: of one loop there are several, see ``schemes``."""
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
                "NUMBA_DISABLE_JIT is set in the environment, and loops are not compiled yet; "
                "expected Numba to compile them: unset it"
            )
        self.compiled += 1
        loop = self._dispatcher()
        types = tuple(map(numba.typeof, arguments))
        loop.compile(types)
        made = loop.overloads[types]
        module = llvm.parse_assembly(loop.inspect_llvm(types))
        entry = module.get_function(made.fndesc.llvm_func_name)
        needs = []
        for value in (*module.functions, *module.global_variables):
            if not value.is_declaration:
                # Seen from outside, loops of one name would share what has one name in them.
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
    """Append what each argument is, and what compiled code is handed for it."""
    for argument in arguments:
        if isinstance(argument, np.ndarray):
            kinds.append((argument.dtype.str, argument.ndim, argument.flags.num & _LAYOUT))
            # Numba's form of an array; its owner, who counts references, is not told.
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
            raise TypeError(f"a loop was given {argument!r}; expected numbers, arrays or records")


def _address(array: Any) -> int:
    """Return where an array lies; a quarter of the time of asking the array."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    except (TypeError, ValueError, BufferError):  # empty, read-only or with gaps
        return array.ctypes.data


def _argument_types(kinds: tuple) -> list:
    """Return the C types of what `_take_apart` hands over."""
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
    """Return what binds the function of some object code to what `_take_apart` makes."""
    import llvmlite.binding as llvm

    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(made.code))
    engine.finalize_object()
    address = engine.get_function_address(made.symbol)
    # Where the result goes, and where an exception: nothing that is compiled here raises one.
    prototype = ctypes.CFUNCTYPE(
        ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *_argument_types(kinds)
    )
    function, returned = prototype(address), _RETURNED[made.returns]

    def bind(values: list, arguments: tuple) -> Callable[[], Any]:
        result, exception = (returned or ctypes.c_int64)(), ctypes.c_void_p()
        whole = (ctypes.addressof(result), ctypes.addressof(exception), *values)

        # What it works with, and on, lives as long as it does.
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
    """Return LLVM's code generator, set as Numba sets it."""
    import llvmlite.binding as llvm

    _start_llvm()
    target = llvm.Target.from_default_triple()
    reloc = "static" if target.name.startswith("x86") else "default"
    return target.create_target_machine(reloc=reloc, codemodel="jitdefault", jit=True, **options)


@lru_cache(maxsize=1)
def _machine_print() -> str:
    """Return all that compiled code depends on besides what was compiled."""
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
    """Return where loops are kept: as Numba keeps them, beside their source where that can be."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given)
    beside = Path(__file__).parent / "__pycache__"
    if os.access(beside if beside.exists() else beside.parent, os.W_OK):
        return beside
    from platformdirs import user_cache_path

    return user_cache_path("chaincor")


def _read(path: Path, key: str) -> ObjectCode | None:
    """Return the compiled loop that a file keeps; None if the file is damaged or stale."""
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
    """Say where a function of another library is, before a loop that calls it is compiled."""
    import llvmlite.binding as llvm

    llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)


def _is_known(name: str) -> bool:
    """Tell LLVM where a function of the mathematical library is, as Numba would."""
    import llvmlite.binding as llvm

    if llvm.address_of_symbol(name) is not None:
        return True
    # Python's own module has that library with it, or the program has where it is part of that.
    function = getattr(ctypes.CDLL(getattr(math, "__file__", None)), name, None)
    if function is not None:
        tell_address(name, function)
    return function is not None


def _write(path: Path, key: str, made: ObjectCode) -> None:
    """Keep a loop for other processes; those that read meanwhile find the old one, or the new."""
    facts = {"key": key, "symbol": made.symbol, "returns": made.returns, "needs": made.needs}
    content = json.dumps(facts).encode() + b"\n" + made.code
    part = path.with_suffix(f".{os.getpid()}")
    # A full or read-only disk costs the next process its time, no more.
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            # The first line is the checksum of all that follows: a damaged symbol would crash.
            part.write_bytes(sha256(content).hexdigest().encode() + b"\n" + content)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
