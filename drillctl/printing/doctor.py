"""What the doctor says, as tables for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl.cli.console import line, table
from drillctl.printing.words import title_of
from drillctl.studies.diagnosis.scheme_reasons import FORMS

if TYPE_CHECKING:
    from drillctl.studies import Doctor

_MODES = {
    "turn": "the others turn too far in a step to be followed; their static share of the pipe "
    "torque is kept",
    "all": "all of the string's",
    "fewest": "never fewer",
    "given": "simulation.modes",
}
_VERDICTS = {
    "ok": "ok: errors are as '{accuracy}' promises",
    "look": "look: the reference solver differs by more than the estimate says",
    "not_reached": "accuracy not reached: errors are larger than '{accuracy}' promises over the "
    "paper's map",
    "refused": "refused",
}


def doctor(result: Doctor) -> None:
    """Scheme and reasons, errors, speed, verdict."""
    title = title_of(result)
    said = result.summary()
    if said["scheme"] is None:
        line(f"{title}: {result.refused}")
        line(f"use {result.advice}")
        return
    _scheme(title, said["scheme"])
    _errors(result, said)
    _speed(said["speed"], said["scheme"])
    line(f"one run (drillctl simulate): the {result.engine} engine")
    line(_VERDICTS[result.verdict].format(accuracy=result.accuracy))
    if result.advice is not None:
        line(f"advice: {result.advice}")


def _scheme(title: str, scheme: dict[str, Any]) -> None:
    rows = [["step", f"{1e3 * scheme['step']:.4g} ms", _why(scheme)]]
    for name, step in sorted(scheme["bounds"].items(), key=lambda bound: bound[1]):
        rows.append([f"  bound: {name}", f"{1e3 * step:.4g} ms", scheme["reasons"][name]])
    left = f", {scheme['modes_left_out']} left out" if scheme["modes_left_out"] else ""
    rows.append(["modes", f"{scheme['modes']}{left}", _MODES[scheme["modes_by"]]])
    turn = f"turns {scheme['turn']:.2f} rad in a step"
    rows.append(["highest mode", f"{scheme['highest_frequency_hz']:.3g} Hz", turn])
    rows.append(["string", FORMS[scheme["string"]], _strings(scheme["strings"])])
    table(f"{title} (accuracy: {scheme['accuracy']})", ["", "chosen", "why"], rows)


def _why(scheme: dict[str, Any]) -> str:
    if scheme["decided_by"] == "sampling":
        return f"{scheme['sampling']} to a period of the sampled controller"
    if scheme["decided_by"] == "program":
        return "whole steps to what changes by the clock"
    return f"{scheme['decided_by']}, and whole steps to the run"


def _strings(count: int) -> str:
    return "" if count == 1 else f"the shortest step of {count} strings"


def _errors(result: Doctor, said: dict[str, Any]) -> None:
    estimate, audit = said["estimate"], said["audit"]
    promised = estimate["promised"]
    rows = [
        ["median", _error(estimate["median"]), _error(promised["median"])],
        ["90th percentile", _error(estimate["p90"]), "-"],
        ["99th percentile", _error(estimate["p99"]), _error(promised["p99"])],
        ["largest", _error(estimate["worst"]), "-"],
    ]
    failed = f", {estimate['failed']} failed" if estimate["failed"] else ""
    order = "" if estimate["order"] is None else f"; order seen: {estimate['order']:.2f}"
    name = f"relative error of J1, estimated from {estimate['lanes']} lanes{failed}{order}"
    table(name, ["", "estimated", f"'{result.accuracy}' over the paper's map"], rows)
    rows = [
        [
            ", ".join(f"{path} = {value:.4g}" for path, value in lane["at"].items()) or "design",
            f"{lane['j1']:.6g}",
            f"{lane['reference_j1']:.6g}",
            _error(lane["relative_difference"]),
            _error(lane["estimated_error"]),
        ]
        for lane in audit["lanes"]
    ]
    heads = ["lane (SI)", "J1 (s)", "reference solver (s)", "difference", "estimated"]
    name = f"audited: {audit['cells']} of {audit['asked']} lanes"
    if audit["cells"] < audit["asked"]:
        name += " (no more are begun after some seconds)"
    if rows:
        table(name, heads, rows)


def _error(value: float | None) -> str:
    return "-" if value is None or value != value else f"{value:.1e}"


def _speed(speed: dict[str, Any], scheme: dict[str, Any]) -> None:
    rows = [
        ["lanes", f"{speed['lanes_per_second']:,.0f} a second, {speed['threads']} threads"],
        ["a step of a lane", f"{speed['lane_step_ns']:.2f} ns of a core"],
    ]
    if speed["mode_ns"] is not None:
        modes = f"{speed['mode_ns']:.3f} ns, {scheme['modes']} of them"
        rows.append(["  of which a mode", modes])
        rows.append(["  laws, inclusion, measures", f"{speed['laws_ns']:.2f} ns"])
    share = f"{speed['share_of_peak']:.0%} of {speed['peak_flops'] / 1e9:.3g} Gflop/s a core"
    rows.append(["modal operations over whole steps", share])
    if speed["pass_share_of_peak"] is not None:
        rows.append(["  over the modal pass alone", f"{speed['pass_share_of_peak']:.0%}"])
    table("speed on this machine, kernel warm", ["", ""], rows)
