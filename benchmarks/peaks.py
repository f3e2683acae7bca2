"""What this machine can do at most, measured: multiply-adds, and traffic with the first cache.

The loops are written in LLVM's language and turned into machine code as they stand, so that no
optimiser removes, merges or splits them: multiply-adds with enough independent accumulators to
hide their latency, loads, and loads and stores in place over a buffer that fits the first cache.
A chain of dependent integer operations of one cycle each gives the clock, by which the peak is
judged: it must be close to a whole number of vector units.
"""

from __future__ import annotations

import ctypes
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

import llvmlite.binding as llvm

ACCUMULATORS = 12
"""Two units of four cycles need eight; sixteen registers hold twelve and two constants."""
BUFFER = 16384
"""Bytes of a buffer that is in the first cache of any processor."""
LINE = 8
"""Vectors to an iteration over the buffer."""
WIDTHS = (2, 4, 8)
"""Doubles in a vector: 128, 256 and 512 bits."""
BURST = 0.004
"""Length of one measurement (s)."""
BURSTS, FEW_BURSTS = 60, 12
"""Measurements of which the best is taken; few for a look."""


@dataclass(frozen=True)
class Machine:
    """Best of several short bursts, on one core and on all at once."""

    cores: int  # cores that this process may use
    vector_bits: int  # width of vector with which the most multiply-adds are done
    clock: float  # of a core that is busy with vectors (Hz)
    # double-precision multiply-adds, two operations each (1/s)
    flops: float
    flops_all: float
    # loads from the first cache (B/s)
    loads: float
    loads_all: float
    # loads plus stores of a buffer changed in place (B/s)
    updates: float
    updates_all: float

    @property
    def flops_per_cycle(self) -> float:
        """Of one core."""
        return self.flops / self.clock

    @property
    def units(self) -> float:
        """Vector units that the peak amounts to; close to 1 or 2 if it is a peak."""
        return self.flops_per_cycle / (2.0 * self.vector_bits / 64)

    def better(self, other: Machine) -> Machine:
        """The best of two measurements of the same machine."""
        values = {k: max(v, getattr(other, k)) for k, v in asdict(self).items()}
        return Machine(**values)


def measure() -> Machine:
    """Measure for about four seconds."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    cores = cores or 1
    peaks = {width: _rate(_fma(width), 1) for width in WIDTHS}
    width = max(peaks, key=lambda w: peaks[w])
    return Machine(
        cores=cores,
        vector_bits=64 * width,
        clock=_rate(_chain(width), 1),
        flops=peaks[width],
        flops_all=_rate(_fma(width), cores),
        loads=_rate(_loads(width), 1),
        loads_all=_rate(_loads(width), cores),
        updates=_rate(_updates(width), 1),
        updates_all=_rate(_updates(width), cores),
    )


def multiply_adds() -> float:
    """Double-precision operations of one core at its best (1/s), two a multiply-add; 0.2 s."""
    return max(_rate(_fma(width), 1, FEW_BURSTS) for width in WIDTHS)


@dataclass(frozen=True, eq=False)
class _Loop:
    """A compiled loop, and what one of its iterations counts."""

    call: Callable[[int], float]
    counts: float


def _rate(loop: _Loop, threads: int, bursts: int = BURSTS) -> float:
    """Best rate of so many copies at once (1/s)."""
    iterations = 1 << 10
    while (seconds := _seconds(loop, iterations)) < BURST:
        iterations = int(iterations * min(8.0, max(1.5, 1.1 * BURST / max(seconds, 1e-9))))
    best = 0.0
    with ThreadPoolExecutor(threads) as pool:
        for _ in range(bursts):
            begin = time.perf_counter()
            list(pool.map(loop.call, [iterations] * threads))
            best = max(best, threads * iterations * loop.counts / (time.perf_counter() - begin))
    return best


def _seconds(loop: _Loop, iterations: int) -> float:
    begin = time.perf_counter()
    loop.call(iterations)
    return time.perf_counter() - begin


@cache
def _fma(width: int) -> _Loop:
    phis, steps, names = _accumulators(width)
    body = _loop(phis, steps, _sum(names, f"<{width} x double>"), width)
    return _Loop(_compiled(body), 2.0 * width * ACCUMULATORS)


def _accumulators(width: int) -> tuple[list[str], list[str], list[str]]:
    """Independent multiply-adds: what they carry round, what they do, their results."""
    vector, numbers = f"<{width} x double>", range(ACCUMULATORS)
    phis = [f"%a{i} = phi {vector} [ %x, %entry ], [ %b{i}, %loop ]" for i in numbers]
    fuse = f"call {vector} @llvm.fma.v{width}f64"
    steps = [f"%b{i} = {fuse}({vector} %a{i}, {vector} %x, {vector} %x)" for i in numbers]
    return phis, steps, [f"%b{i}" for i in numbers]


@cache
def _loads(width: int) -> _Loop:
    # Volatile: done though nobody looks, so that no arithmetic stands in the way.
    vector, lines = f"<{width} x double>", range(LINE)
    steps = []
    for i in lines:
        steps += [*_at(i, vector), f"%b{i} = load volatile {vector}, ptr %p{i}, align 64"]
    body = _loop([], steps, _sum([f"%b{i}" for i in lines], vector), width)
    return _Loop(_compiled(body), 8.0 * width * LINE)


@cache
def _updates(width: int) -> _Loop:
    vector, lines = f"<{width} x double>", range(LINE)
    steps = []
    for i in lines:
        steps += _at(i, vector)
        steps += [f"%l{i} = load {vector}, ptr %p{i}, align 64"]
        steps += [f"%s{i} = fmul {vector} %l{i}, %x", f"store {vector} %s{i}, ptr %p{i}, align 64"]
    body = _loop([], steps, _sum(["%s0"], vector), width)
    return _Loop(_compiled(body), 2.0 * 8.0 * width * LINE)


@cache
def _chain(width: int) -> _Loop:
    # Wide vectors lower the clock: the chain runs beside multiply-adds at half their peak.
    phis, fused, names = _accumulators(width)
    steps, last = [], "%c"
    for i, fma in enumerate(fused):
        # Exclusive or and addition in turn: no two of them can be made one.
        kind = "xor" if i % 2 else "add"
        steps += [f"%e{i} = {kind} i64 {last}, %n", fma]
        last = f"%e{i}"
    phis += [f"%c = phi i64 [ %n, %entry ], [ {last}, %loop ]"]
    *total, _ = _sum(names, f"<{width} x double>")
    end = [*total, f"%q = sitofp i64 {last} to double", "%w = fadd double %r, %q", "ret double %w"]
    return _Loop(_compiled(_loop(phis, steps, end, width)), float(ACCUMULATORS))


def _at(i: int, vector: str) -> list[str]:
    """Address of the i-th vector of this iteration, round and round the buffer."""
    return [
        f"%o{i} = add i64 %base, {i}",
        f"%p{i} = getelementptr {vector}, ptr %buffer, i64 %o{i}",
    ]


def _sum(names: list[str], vector: str) -> list[str]:
    lines, last = [], names[0]
    for i, name in enumerate(names[1:]):
        lines += [f"%t{i} = fadd {vector} {last}, {name}"]
        last = f"%t{i}"
    return [*lines, f"%r = extractelement {vector} {last}, i32 0", "ret double %r"]


def _loop(phis: list[str], steps: list[str], end: list[str], width: int) -> str:
    """Function `double f(n, buffer)` that goes round n times; %x is a vector of ones."""
    vector = f"<{width} x double>"
    ones = ", ".join(["double 1.0"] * width)
    mask = BUFFER // (8 * width) - 1
    lines = [
        f"declare {vector} @llvm.fma.v{width}f64({vector}, {vector}, {vector})",
        "define double @f(i64 %n, ptr %buffer) #0 {", "entry:",
        # Read from memory, so that nobody knows that they are ones.
        f"store {vector} <{ones}>, ptr %buffer, align 64",
        f"%x = load volatile {vector}, ptr %buffer, align 64",
        "br label %loop", "loop:", "%i = phi i64 [ 0, %entry ], [ %next, %loop ]",
        *phis, f"%lines = mul i64 %i, {LINE}", f"%base = and i64 %lines, {mask}", *steps,
        "%next = add i64 %i, 1", "%more = icmp ult i64 %next, %n",
        "br i1 %more, label %loop, label %done", "done:", *end, "}",
        # LLVM keeps to 256 bits otherwise.
        'attributes #0 = { "prefer-vector-width"="512" "min-legal-vector-width"="512" }',
    ]  # fmt: skip
    return "\n".join(lines)


def _compiled(code: str) -> Callable[[int], float]:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=3
    )
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(code), target)
    engine.finalize_object()
    kind = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_int64, ctypes.c_void_p)
    function = kind(engine.get_function_address("f"))

    # The engine owns the code: it must live as long as the function.
    def call(iterations: int, owner: Any = engine) -> float:
        raw = ctypes.create_string_buffer(BUFFER + 4096)
        return float(function(iterations, (ctypes.addressof(raw) + 4095) & ~4095))

    return call
