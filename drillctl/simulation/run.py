"""One run of a design, by either engine."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.simulation import measures as m
from drillctl.simulation.trajectory import Simulation, sample

Array = NDArray[np.float64]


def simulate(
    design: Design,
    engine: Literal["reference", "batch"] | None = None,
    interval: float = 0.01,
    **values: Any,
) -> Simulation:
    """Simulate a design.

    Parameters
    ----------
    design : Design
        Rig, control, start and duration.
    engine : {'reference', 'batch'}, optional
        By default the design's `simulation.engine`, and the reference solver if it has none.
    interval : float
        Sampling interval of the signals (s).
    **values
        Dotted path to value, laid over the design first.

    Returns
    -------
    Simulation
        Signals, events, measures, status.

    Raises
    ------
    InputError
        Unknown path or impossible value; a step too long for the friction law.
    SimulationError
        The reference solver could not finish.
    """
    design = design.replace(values) if values else design
    engine = engine or design.tables.simulation.engine or "reference"
    if engine == "reference":
        from drillctl.simulation.reference import solve

        return sample(solve(design), interval)
    return _by_batch(design, interval)


def _by_batch(design: Design, interval: float) -> Simulation:
    from drillctl.simulation.batch import measures_of, prepare, run_batch, trace
    from drillctl.simulation.lanes import single_lane

    lanes = single_lane(design)
    prepared = prepare(lanes, design.tables.simulation)
    batch = run_batch(lanes, prepared)
    time, traced = trace(lanes, prepared, interval)
    scheme = prepared.scheme
    return Simulation(
        design=design,
        time=time,
        signals=_signals({name: values[:, 0] for name, values in traced.items()}),
        events=(),
        measures=measures_of(batch, 0),
        status=m.STATUSES[batch.status[0]],
        engine="batch",
        step=scheme.step,
        modes=scheme.modes,
        energy=None,
    )


def _signals(traced: dict[str, Array]) -> dict[str, Array]:
    """The signals of a `Simulation` from those of a trace."""
    top_angle, top_speed = traced["top_angle"], traced["top_speed"]
    return {
        "top_speed": top_speed,
        "bit_speed": traced["bit_speed"],
        "twist": top_angle - traced["bit_angle"],
        "top_angle": top_angle,
        "bit_angle": traced["bit_angle"],
        "top_torque": traced["top_torque"],
        "pipe_torque": traced["pipe_torque"],
        "bit_torque": traced["bit_torque"],
        "weight_on_bit": traced["weight_on_bit"],
        "stuck": traced["stuck"],
    }
