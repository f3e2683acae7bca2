"""Laws as compiled functions behind an address, so that one compiled solver serves all of them.

A call costs some nanoseconds and a law compiles by itself, once per machine. The Python of
each law stays the only place of its equation.
"""

from __future__ import annotations

import hashlib
import inspect
import math
import types as python_types
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba import types

from drillctl.simulation import kernel_cache

OPTIONS: dict[str, Any] = {"error_model": "numpy"}
INNER: dict[str, Any] = OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Of a function that compiled ones alone call: what turns objects of Python into its numbers took
a quarter of the time to compile."""
compiled = numba.njit(fastmath={"contract"}, nogil=True, _nrt=False, **INNER)
"""Decorator of what is part of a solver: products and sums may be fused, nothing else.

No references are counted: each look at an array would count up and down, atomically, and a tuple of
arrays all of its own, which took a third of a run. So nothing here may make an array: what shows
numbers that the caller keeps is `reference_rates.view`.
"""
STATE = types.CPointer(types.float64)  # how an array is passed
CALL = (STATE, *[types.float64] * 4)  # numbers of a law, and four more, used or not

FARTHEST = 100.0
"""Largest exponent: a trial step far past zero speed is to be rejected, not to overflow."""


def on_disk(function: Any) -> Any:
    """Compile a function of the solver, kept on disk under a name that its sources are part of.

    So that a change in any of them is noticed: numba looks at the date of one file only.
    """
    function.__name__ = function.__qualname__ = f"{function.__name__}_{version()}"
    return kernel_cache.njit(function, nogil=True, fastmath={"contract"}, **OPTIONS)


@cache
def version() -> str:
    """Hash of every source that is compiled into the reference solver; laws are apart from it."""
    here = Path(__file__).resolve().parent
    rig = here.parent / "rig"
    own = [here / "law_calls.py", *here.glob("reference_*.py")]
    return _hash([*own, rig / "program.py", rig / "top_drive/real_drive.py"])


@cache
def _version_of_laws() -> str:
    """Hash of every source of a law, and of how it is called."""
    here = Path(__file__).resolve().parent
    return _hash([here / "law_calls.py", *here.parent.glob("rig/**/*.py")])


def _hash(paths: list[Path]) -> str:
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@numba.njit(**INNER)
def _exp(x: float) -> float:
    return math.exp(min(x, FARTHEST))


# What each call computes, from the law `law` and the numbers a, b, c, d.
FORMS = {
    "torque_and_slope": "method(law, a, b, exp)[0]",
    "static_torque": "method(law, a)",
    "torque": "method(law, a, b)",
    "weight": "method(law, a)",
    "command": "method(law, a, b)",
    "next_level": "method(law, a, b, c, d)",
}


def address(law: Any, method: str) -> int:
    """Address of a method of a law, compiled for the type of the law."""
    kind: Any = type(law)
    return int(_compiled(kind, method).address)


@cache
def _compiled(kind: Any, method: str) -> Any:
    name = f"{kind.__name__}_{method}_{_version_of_laws()}"
    fields = ", ".join(f"p[{k}]" for k in range(len(kind._fields)))
    text = (
        f"def {name}(rig, numbers, a, b, c, d):\n"
        f"    p = carray(numbers, {max(1, len(kind._fields))})\n"
        f"    law = Law({fields})\n"
        f"    return {FORMS[method]}\n"
    )
    scope: dict[str, Any] = {
        "__name__": __name__, "carray": numba.carray, "Law": kind, "exp": _exp,
        "method": jitted(getattr(kind, method)),
    }  # fmt: skip
    # Under the name of this file, next to which numba keeps what it compiles.
    exec(compile(text, __file__, "exec"), scope)
    ours = kind.__module__.startswith("drillctl.")
    signature = types.float64(types.voidptr, *CALL)
    return kernel_cache.cfunc(signature, scope[name], cache=ours, **OPTIONS)


def jitted(function: Any) -> Any:
    """A function of this package compiled, with the functions of its module that it calls."""
    if not isinstance(function, python_types.FunctionType):
        return function
    scope = dict(function.__globals__)
    for name in function.__code__.co_names:
        helper = scope.get(name)
        if inspect.isfunction(helper) and helper.__module__ == function.__module__:
            scope[name] = jitted(helper)
    copy = python_types.FunctionType(
        function.__code__, scope, function.__name__, function.__defaults__, function.__closure__
    )
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return numba.njit(**INNER)(copy)


def from_numbers(kind: Any) -> Any:
    """A compiled function that makes a law of a flat array of its numbers."""
    fields = ", ".join(f"p[{k}]" for k in range(len(kind._fields)))
    scope: dict[str, Any] = {"Law": kind}
    exec(f"def made(p):\n    return Law({fields})", scope)
    return numba.njit(**INNER)(scope["made"])
