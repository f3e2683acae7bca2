"""CVODE without Python: the library inside scikit-sundae, with a right-hand side in machine code.

scikit-sundae's own interface calls back into Python at every evaluation. This row shows what
CVODE itself costs: integration, right-hand side and root finding are all compiled, and Python is
entered a few dozen times a run, when a phase ends.
"""

from __future__ import annotations

import ctypes as c
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numba import carray, cfunc, types

from benchmarks.job import Array, Job
from benchmarks.peers.compiled import event, packed, rates
from benchmarks.peers.phases import Phases, march, phases

TITLE = "CVODE (its C library)"
RTOL, ATOL = 1e-6, 1e-8
ADAMS, NORMAL, ROOT_FOUND = 1, 1, 2  # of cvode.h
MOST_STEPS = 1_000_000
POINTER, NUMBER, INTEGER, INDEX = c.c_void_p, c.c_double, c.c_int, c.c_int64

PROTOTYPES: dict[str, tuple[Any, ...]] = {
    "SUNContext_Create": (INTEGER, INTEGER, POINTER),
    "SUNContext_Free": (INTEGER, POINTER),
    "N_VMake_Serial": (POINTER, INDEX, POINTER, POINTER),
    "N_VGetArrayPointer": (c.POINTER(NUMBER), POINTER),  # a type that numba can index
    "N_VDestroy": (None, POINTER),
    "CVodeCreate": (POINTER, INTEGER, POINTER),
    "CVodeInit": (INTEGER, POINTER, POINTER, NUMBER, POINTER),
    "CVodeReInit": (INTEGER, POINTER, NUMBER, POINTER),
    "CVodeSStolerances": (INTEGER, POINTER, NUMBER, NUMBER),
    "CVodeSetUserData": (INTEGER, POINTER, POINTER),
    "CVodeSetMaxNumSteps": (INTEGER, POINTER, c.c_long),
    "CVodeSetStopTime": (INTEGER, POINTER, NUMBER),
    "CVodeRootInit": (INTEGER, POINTER, INTEGER, POINTER),
    "CVodeSetRootDirection": (INTEGER, POINTER, POINTER),
    "SUNNonlinSol_FixedPoint": (POINTER, POINTER, INTEGER, POINTER),
    "SUNNonlinSolFree": (INTEGER, POINTER),
    "CVodeSetNonlinearSolver": (INTEGER, POINTER, POINTER),
    "CVode": (INTEGER, POINTER, NUMBER, POINTER, POINTER, INTEGER),
    "CVodeFree": (None, POINTER),
}
"""Result and arguments of what is called, from the headers of SUNDIALS 7."""


@cache
def library() -> Any:
    """The shared library that scikit-sundae brings.

    Raises
    ------
    ImportError
        scikit-sundae is not installed, or keeps its library elsewhere.
    """
    import sksundae  # loads what the library depends on

    folder = Path(sksundae.__file__).parents[1] / "scikit_sundae.libs"
    found = sorted(folder.glob("libsundials_cvode*.so*"))
    if not found:
        raise ImportError(f"no libsundials_cvode in {folder}")
    loaded = c.CDLL(str(found[0]), mode=c.RTLD_GLOBAL)
    for name, (result, *arguments) in PROTOTYPES.items():
        function = getattr(loaded, name)
        function.restype, function.argtypes = result, arguments
    return loaded


@cache
def callbacks(size: int) -> tuple[Any, Any]:
    """Right-hand side and root function of systems of so many states, as C functions."""
    values = library().N_VGetArrayPointer
    n = (size - 1) // 2
    length = 8 + 4 * n + n * n  # of `compiled.packed`
    pointer = types.voidptr

    @cfunc(types.int32(types.float64, pointer, pointer, pointer))
    def rhs(time, y, out, numbers):
        rates(
            carray(values(y), (size,), np.float64),
            carray(values(out), (size,), np.float64),
            carray(numbers, (length,), np.float64),
        )
        return 0

    @cfunc(types.int32(types.float64, pointer, types.CPointer(types.float64), pointer))
    def root(time, y, out, numbers):
        out[0] = event(
            carray(values(y), (size,), np.float64), carray(numbers, (length,), np.float64)
        )
        return 0

    return rhs, root


class Solver:
    """One CVODE object over a whole run, its memory owned here."""

    def __init__(self, system: Phases, rtol: float, atol: float) -> None:
        lib = self.lib = library()
        self.numbers = {direction: packed(system, direction) for direction in (-1, 0, 1)}
        self.y = system.start()
        rhs, root = callbacks(len(self.y))
        self.context = POINTER()
        _checked(lib.SUNContext_Create(0, c.byref(self.context)))
        self.vector = lib.N_VMake_Serial(len(self.y), self.y.ctypes.data, self.context)
        self.memory = POINTER(lib.CVodeCreate(ADAMS, self.context))
        _checked(lib.CVodeInit(self.memory, rhs.address, 0.0, self.vector))
        _checked(lib.CVodeSStolerances(self.memory, rtol, atol))
        _checked(lib.CVodeSetMaxNumSteps(self.memory, MOST_STEPS))
        self.iteration = lib.SUNNonlinSol_FixedPoint(self.vector, 0, self.context)
        _checked(lib.CVodeSetNonlinearSolver(self.memory, self.iteration))
        _checked(lib.CVodeRootInit(self.memory, 1, root.address))
        falling = np.array([-1], dtype=np.int32)
        _checked(lib.CVodeSetRootDirection(self.memory, falling.ctypes.data))
        self.end = system.rig.duration

    def integrate(self, time: float, y: Array, direction: int) -> tuple[float, Array, bool]:
        """`phases.Integrate`."""
        lib, reached = self.lib, NUMBER()
        self.y[:] = y
        _checked(lib.CVodeReInit(self.memory, time, self.vector))
        _checked(lib.CVodeSetUserData(self.memory, self.numbers[direction].ctypes.data))
        _checked(lib.CVodeSetStopTime(self.memory, self.end))
        done = _checked(lib.CVode(self.memory, self.end, self.vector, c.byref(reached), NORMAL))
        return reached.value, self.y.copy(), done == ROOT_FOUND

    def close(self) -> None:
        """Give the library's memory back."""
        self.lib.CVodeFree(c.byref(self.memory))
        self.lib.SUNNonlinSolFree(self.iteration)
        self.lib.N_VDestroy(self.vector)
        self.lib.SUNContext_Free(c.byref(self.context))


def _checked(code: int) -> int:
    if code < 0:
        raise ArithmeticError(f"CVODE returned {code}")
    return code


@dataclass(frozen=True, eq=False)
class CvodeLibrary:
    """Adams methods of CVODE, one cell at a time."""

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]
    systems: dict[int, Phases]
    rtol: float = RTOL
    atol: float = ATOL

    def run(self, cells: tuple[int, ...]) -> Array:
        return np.array([self._j1(self.systems[cell]) for cell in cells])

    def _j1(self, system: Phases) -> float:
        solver = Solver(system, self.rtol, self.atol)
        try:
            return march(system, solver.integrate)
        finally:
            solver.close()


def make(job: Job) -> list[CvodeLibrary]:
    systems = {cell: phases(job.rig(cell)) for cell in job.cells}
    callbacks(len(systems[job.cells[0]].start()))
    jobs = tuple((cell,) for cell in job.cells)
    solves = "set-valued friction; stick and slip as phases, changes located; Adams, all compiled"
    name = f"{TITLE}, rtol {RTOL:.0e}"
    return [CvodeLibrary(name, solves, 1, jobs, systems)]
