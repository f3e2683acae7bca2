"""Write the table of `limit-cycles.md`: one harmonic against the exact cycle.

python docs/make_limit_cycles.py
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import drillctl
from drillctl import units
from drillctl.simulation.limit_cycle import LimitCycle, limit_cycle

PAGE = Path(__file__).with_name("limit-cycles.md")
MARKS = ("<!-- table: begin, made by make_limit_cycles.py -->", "<!-- table: end -->")
HEAD = (
    "| no. | case | period, one harmonic (s) | exact (s) | error | peak, one harmonic (rpm) "
    "| exact (rpm) | error | amplitude, error | stuck | largest multiplier |",
    "|---|---|---|---|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True)
class Case:
    """A row: its name, the design, and what is laid over it."""

    name: str
    design: str
    values: dict[str, Any] = field(default_factory=dict)


def _string(
    name: str, weight: int, kp: float, ki: float, damping: str = "1 ms", **others: Any
) -> Case:
    values = {
        "operating_point.weight_on_bit": f"{weight} kN",
        "controller.kp": kp,
        "controller.ki": ki,
        "drillstring.sections.pipe.stiffness_damping": damping,
    }
    return Case(name, "monteiro-trindade-2012", values | others)


CASES = (
    Case("2-DOF, 10 kN m", "navarro-lopez-2dof-bistable"),
    Case("2-DOF, 10.5 kN m", "navarro-lopez-2dof-bistable", {"controller.torque": "10.5 kN*m"}),
    _string("80 kN, PI (50, 100)", 80, 50, 100),
    _string("120 kN, PI (200, 50)", 120, 200, 50),
    _string("120 kN, PI (200, 100)", 120, 200, 100),
    _string("120 kN, PI (1000, 400)", 120, 1000, 400),
    _string("120 kN, PI (200, 100), 60 rpm", 120, 200, 100, **{"operating_point.speed": "60 rpm"}),
    _string("160 kN, PI (200, 100)", 160, 200, 100),
    _string("120 kN, PI (100, 100)", 120, 100, 100),
    _string("120 kN, PI (200, 100), undamped", 120, 200, 100, "0 s"),
)


def main() -> None:
    """Write the table between its marks."""
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    table = "\n".join([*HEAD, *(row(number, case) for number, case in enumerate(CASES, 1))])
    PAGE.write_text(f"{before}{MARKS[0]}\n{table}\n{MARKS[1]}{after}", encoding="utf-8")


def row(number: int, case: Case) -> str:
    """One row of the table."""
    result = limit_cycle(drillctl.load(case.design, **case.values))
    quick = result.predicted
    assert quick is not None
    period, peak, amplitude, stuck = _exact(result)
    multiplier = f"{abs(result.orbit.multipliers[0]):.3f}" if result.orbit else result.status
    cells = [
        str(number),
        case.name,
        f"{quick.period:.3f}",
        _ranged(period, 3),
        _error(quick.period, period),
        f"{quick.peak_speed / units.RPM:.1f}",
        _ranged([value / units.RPM for value in peak], 1),
        _error(quick.peak_speed, peak),
        _error(quick.amplitude, amplitude),
        f"{100 * sum(stuck) / sum(period):.0f} %",
        multiplier,
    ]
    return f"| {' | '.join(cells)} |"


def _exact(result: LimitCycle) -> tuple[list[float], list[float], list[float], list[float]]:
    """Period, peak, amplitude, time stuck: the orbit's, or least and most of the last returns."""
    orbit, run = result.orbit, result.simulated
    if orbit is not None:
        return [orbit.period], [orbit.peak_bit_speed], [orbit.amplitude], [orbit.stuck_time]
    spread = run.summary()
    low = float(run.bit_speed.min())
    return (
        spread["period_spread"],
        spread["peak_spread"],
        [0.5 * (peak - low) for peak in spread["peak_spread"]],
        spread["stuck_time_spread"],
    )


def _ranged(values: list[float], digits: int) -> str:
    return " to ".join(f"{value:.{digits}f}" for value in values)


def _error(quick: float, exact: list[float]) -> str:
    """Relative error against the middle of what is exact."""
    middle = sum(exact) / len(exact)
    return f"{100 * (quick / middle - 1):+.1f} %"


if __name__ == "__main__":
    main()
