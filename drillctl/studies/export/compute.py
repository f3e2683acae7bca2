"""The result of an export, and `export`, which makes it."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from drillctl import units
from drillctl.design import Design, to_toml
from drillctl.design.parts import torque_at_set_speed
from drillctl.errors import InputError, shown
from drillctl.progress import SILENT, Progress
from drillctl.rig.top_drive import SampledDrive
from drillctl.store.codec import label
from drillctl.store.result import Result
from drillctl.studies.export.law import FIELD, PARAMETERS, SI, Base, DriveLaw, Symbol, drive_law
from drillctl.studies.export.writers import FORMATS, Written

Format = Literal["structured-text", "plcopen", "c", "json", "csv"]


@dataclass(frozen=True, eq=False)
class Export(Result, kind="export"):
    """The discrete law of a drive."""

    design: Design = label(means="what it was written for")
    format: str = label(means="what it is written in")
    per_unit: bool = label(means="whether it is in shares of rated torque and speed")

    @cached_property
    def sampled(self) -> Design:
        """The design with a drive that samples."""
        if self.assumed is None:
            return self.design
        return self.design.replace({"controller.drive.sampling_period": units.SI(self.assumed)})

    @property
    def assumed(self) -> float | None:
        """Sampling period (s) that a drive in continuous time was given; None of a sampled one."""
        if self.design.tables.controller.drive.sampling_period > 0.0:
            return None
        return float(self.design.tables.export.sampling_period)

    @property
    def drive(self) -> SampledDrive:
        """The numbers of the law."""
        drive = self.sampled.top_drive
        assert isinstance(drive, SampledDrive)
        return drive

    @property
    def rated(self) -> tuple[float, float]:
        """Torque (N m) and speed (rad/s) at the pipe that are one per unit."""
        own, drive, design = self.design.tables.export, self.drive, self.design
        steady = torque_at_set_speed(design.tables)
        steady += float(design.string.ground_damping.sum()) * design.speed
        torque = own.rated_torque or (drive.most if math.isfinite(drive.most) else steady or 1e3)
        speed = own.rated_speed or (1.0 / drive.slowness if drive.slowness > 0.0 else design.speed)
        return float(torque), float(speed)

    def base(self, system: units.System) -> Base:
        """What its text is in."""
        if self.per_unit:
            return Base(*self.rated, ("pu", "pu"))
        return FIELD if system == "field" else SI

    def law(self, system: units.System = "si") -> DriveLaw:
        """Its statements, in the units of a reader."""
        return drive_law(self.drive, self.sampled.program.speed, self.base(system))

    def rows(self, system: units.System = "si") -> tuple[tuple[Symbol, float, float, float], ...]:
        """Parameters of the text: value, value in SI, per unit."""
        program, own = self.sampled.program.speed, self.law(system).numbers
        plain = drive_law(self.drive, program).numbers
        shares = drive_law(self.drive, program, Base(*self.rated)).numbers
        known = (one for one in PARAMETERS.values() if one.name in own)
        return tuple((one, own[one.name], plain[one.name], shares[one.name]) for one in known)

    def text(self, system: units.System = "si") -> str:
        """The law in its format.

        Parameters
        ----------
        system : {'si', 'field'}
            Units of torque and speed, unless it is per unit.

        Returns
        -------
        str
            The whole file.
        """
        notes = tuple(units.told(note, system) for note in self.sentences())
        written = Written(
            self.law(system), self.design.name, identity(self.design), notes, self.rows(system)
        )
        return FORMATS[self.format][0](written)

    def sentences(self) -> tuple[str, ...]:
        """What a reader of the text must know, quantities in SI."""
        drive, rig = self.drive, self.design.tables.top_drive
        torque, speed = (units.full(one, unit) for one, unit in zip(self.rated, ("N*m", "rad/s"),
                                                                    strict=True))  # fmt: skip
        said = [
            f"Call the controller every {drive.period * 1e3:g} ms."
            + (" The design's drive is in continuous time: this sampling period is assumed "
               "(export.sampling_period)." if self.assumed else ""),
            "Torque and speed count at the pipe, positive as the drive turns and drives. One per "
            f"unit is {torque} and {speed}.",
            "While not enabled the law follows the drive: enabled bumpless it takes over at the "
            "present torque and speed, else from nothing, as a simulated run starts.",
        ]  # fmt: skip
        if drive.late:
            said.append("A command is given out one period after its sample.")
        if drive.encoder > 0.0:
            said.append(
                f"The encoder lags by {drive.encoder * 1e3:g} ms, which is not in the text."
            )
        if drive.lag > 0.0:
            said.append(
                "The motor is how the drive is simulated to follow a command, for a test without "
                "one; its mean torque is what the controller is told as torque."
            )
        if rig.gear_ratio is not None:
            gain = rig.motors * rig.gear_ratio * rig.efficiency
            said.append(
                f"Of {rig.motors} motor(s) behind a gear of {rig.gear_ratio:g}: torque of one is "
                f"1/{gain:.6g} of that at the pipe, speed {rig.gear_ratio:g} times."
            )
        return tuple(said)

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """The design and settings of the command."""
        changed = {"format": self.format} if self.format != "structured-text" else {}
        return self.design, changed | ({"per_unit": True} if self.per_unit else {})

    def summary(self) -> dict[str, Any]:
        """Format, sampling period, rated values, parameters in SI and per unit."""
        return {
            "format": self.format,
            "per_unit": self.per_unit,
            "sampling_period": float(self.drive.period),
            "sampling_period_assumed": self.assumed is not None,
            "sha256": identity(self.design),
            "rated": {"torque": self.rated[0], "speed": self.rated[1]},
            "parameters": {
                one.name: {"value": si, "unit": SI.unit(one.dimension), "per_unit": share}
                for one, _, si, share in self.rows()
            },
        }


def identity(design: Design) -> str:
    """SHA-256 of the resolved design."""
    return hashlib.sha256(to_toml(design).encode()).hexdigest()


def export(
    design: Design,
    format: Format = "structured-text",
    per_unit: bool = False,
    progress: Progress = SILENT,
) -> Export:
    """Write the law of a drive for the drive itself.

    The discrete law that is simulated: what `sample` of `rig.top_drive.real_drive` computes at each
    sample, with the numbers of this drive. A drive in continuous time is sampled every
    `export.sampling_period`.

    Parameters
    ----------
    design : Design
        With any drive law.
    format : {'structured-text', 'plcopen', 'c', 'json', 'csv'}
        IEC 61131-3 text, the same as PLCopen XML, C99; statements and symbols; symbols alone.
    per_unit : bool
        Whether in shares of rated torque and speed, in place of units.
    progress : Progress
        Not used.

    Returns
    -------
    Export
        With the whole as `text()`.

    Raises
    ------
    InputError
        An unknown format, or a sampling period as long as the run.
    """
    if format not in FORMATS:
        raise InputError(f"{shown(format)} is none of {', '.join(FORMATS)}", "format")
    made = Export(design, format, per_unit)
    made.law()
    return made
