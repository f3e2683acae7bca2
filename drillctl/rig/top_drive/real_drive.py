"""A drive as it is built: filters, torque feedback, limits, lag; in continuous or sampled time."""

from __future__ import annotations

from typing import Any, NamedTuple


class RealDrive(NamedTuple):
    r"""Speed control with what makes a drive real, in continuous time.

    The encoder shows the speed late, the torque that the controller feels is that of the motor
    less what an inertia takes, the command is limited, and the motor follows with a lag:

    .. math:: \tau_e \dot\omega_e = \omega - \omega_e, \quad
              \tau_x \dot x = T - J_x \dot\omega_e - x, \quad
              \dot l = \omega_c (x - l)

    .. math:: e = \Omega - \omega_e - m\,(x - l), \quad
              c = T_0 + K_p e + K_i I, \quad
              \dot I = e + \frac{k_t}{K_i} (\mathrm{sat}\,c - c)

    .. math:: \mathrm{sat}\,c = \max(T_{min}, -P/|\omega|) \ldots \min(T_{max}, P/|\omega|), \quad
              \dot T = \frac{\mathrm{sat}\,c - T}{\tau_T}, \; |\dot T| \le R

    With `mobility` m = 0 it is a PI. With J_x the inertia of the drive x is the torque that the
    pipe takes, and m = a / zeta is Z-torque (impedance matching; a = 1 the torsional
    rectification of Tucker & Wang 1999 in its ideal limit). With J_x = 0 it is the motor torque,
    and m = 1 / c_f, corner k_f / c_f is active damping (after Jansen & van den Steen 1995): the
    drive looks like a spring k_f and a damper c_f. Anti-windup is by back-calculation (Astrom &
    Hagglund, PID Controllers, 1995).

    Attributes
    ----------
    feedforward : float
        T_0, torque at no error (N m): the level of a drive at constant torque, else 0.
    kp, ki : float
        Gains (N m s/rad, N m/rad).
    mobility : float
        m, by how much the set speed gives way to the torque felt (rad/s per N m).
    sensed_inertia : float
        J_x, whose torque is taken off that of the motor (kg m2).
    corner : float
        omega_c of the high-pass on the torque felt (rad/s).
    encoder, torque_filter, lag : float
        Time constants tau_e, tau_x, tau_T (s); zero for none.
    least, most : float
        Torque limits (N m); infinite for none.
    power : float
        Power limit P (W); infinite for none.
    rate : float
        Limit R of the torque's rate (N m/s); infinite for none, else with a lag.
    tracking : float
        k_t (1/s), rate at which a limited integral gives in; 0 without anti-windup.
    """

    feedforward: Any
    kp: Any
    ki: Any
    mobility: Any
    sensed_inertia: Any
    corner: Any
    encoder: Any
    torque_filter: Any
    lag: Any
    least: Any
    most: Any
    power: Any
    rate: Any
    tracking: Any

    def gains(self) -> tuple[Any, Any]:
        """Proportional (N m s/rad) and integral (N m/rad) gain of the speed controller."""
        return self.kp, self.ki

    def torque(self, angle: Any, speed: Any) -> Any:
        """Torque (N m) in steady motion at `angle` (rad) and `speed` (rad/s) in the frame."""
        return self.feedforward - self.kp * speed - self.ki * angle

    def impedance(self, s: Any) -> Any:
        """Torque that the drive takes per speed of the string (N m s/rad) at `s` (1/s)."""
        return _impedance(self, s, 1.0)


class SampledDrive(NamedTuple):
    r"""The drive of `RealDrive` with a controller that works at equal intervals.

    At the times k h the controller reads speed and torque, computes its command and holds it for
    one period; the filters of the torque work on the mean torque of the last period, the encoder
    and the motor stay what they are. With `late` the command is given out one period later.

    Attributes
    ----------
    feedforward, kp, ki, mobility, sensed_inertia, corner, encoder, torque_filter, lag : float
        As in `RealDrive`.
    least, most, power, rate, tracking : float
        As in `RealDrive`.
    period : float
        h (s).
    late : float
        Periods that a command waits before it is given out: 0 or 1.
    """

    feedforward: Any
    kp: Any
    ki: Any
    mobility: Any
    sensed_inertia: Any
    corner: Any
    encoder: Any
    torque_filter: Any
    lag: Any
    least: Any
    most: Any
    power: Any
    rate: Any
    tracking: Any
    period: Any
    late: Any

    def gains(self) -> tuple[Any, Any]:
        """Proportional (N m s/rad) and integral (N m/rad) gain of the speed controller."""
        return self.kp, self.ki

    def torque(self, angle: Any, speed: Any) -> Any:
        """Torque (N m) in steady motion at `angle` (rad) and `speed` (rad/s) in the frame."""
        return self.feedforward - self.kp * speed - self.ki * angle

    def impedance(self, s: Any) -> Any:
        """Impedance (N m s/rad) at `s` (1/s); sampling counts as its mean delay.

        A command held over a period is half a period late on the mean: a good account of the
        sampled loop well below the sampling frequency.
        """
        import numpy as np

        return _impedance(self, s, np.exp(-s * (0.5 + self.late) * self.period))


def _impedance(drive: RealDrive | SampledDrive, s: Any, held: Any) -> Any:
    """Torque per speed with the command passed on by the factor `held`.

    T = -g (c - loss), with the command's response to speed and to the torque itself eliminated.
    """
    seen = 1.0 / (1.0 + s * drive.encoder)
    controller = drive.kp + drive.ki / s
    felt = drive.mobility * s / (s + drive.corner) / (1.0 + s * drive.torque_filter)
    follows = held / (1.0 + s * drive.lag)
    # T = -follows C [seen w + felt (T - J s seen w)]
    given = follows * controller
    return given * seen * (1.0 - felt * drive.sensed_inertia * s) / (1.0 + given * felt)
