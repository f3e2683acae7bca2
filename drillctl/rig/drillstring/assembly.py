"""Mass, damping and stiffness of a whole string, from its sections and its two ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.errors import InputError
from drillctl.rig.drillstring import frequencies
from drillctl.rig.drillstring.section import Parts, Section

if TYPE_CHECKING:
    import scipy.sparse

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Drillstring:
    """M u'' + C u' + K u = F of the string, its top drive and its BHA.

    Attributes
    ----------
    depth : ndarray, shape (nodes,)
        Measured depth of each node (m).
    node_section : tuple of str, shape (nodes,)
        Name of the section above each node; the top drive for node 0.
    mass, damping, stiffness : sparse array, shape (nodes, nodes)
        M (kg m2), C (N m s/rad) and K (N m/rad).
    ground_damping : ndarray, shape (nodes,)
        C times a rigid rotation at 1 rad/s: torque (N m s/rad) that damping to ground takes
        at each node. Zero where all damping is internal.
    element_stiffness, element_damping : ndarray, shape (elements,)
        Of each two-node element (N m/rad, N m s/rad), top to bottom.
    classical : bool
        True where the undamped modes diagonalise C.
    yield_torque : float
        Torsional yield of the uppermost pipe (N m); infinite when unknown.
    parts : Parts
        What the matrices were assembled from.
    """

    depth: Array
    node_section: tuple[str, ...]
    mass: scipy.sparse.csr_array
    damping: scipy.sparse.csr_array
    stiffness: scipy.sparse.csr_array
    ground_damping: Array
    element_stiffness: Array
    element_damping: Array
    classical: bool
    yield_torque: float
    parts: Parts

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.depth)

    @property
    def undamped(self) -> bool:
        """Whether C is zero."""
        return self.damping.count_nonzero() == 0

    @property
    def static_stiffness(self) -> float:
        """Stiffness of the string between its ends (N m/rad)."""
        return float(1.0 / np.sum(1.0 / self.element_stiffness))

    # What drives are tuned to.

    @property
    def pipe_impedance(self) -> float:
        """Characteristic impedance of the uppermost pipe (N m s/rad): J sqrt(G rho).

        A lumped spring has none (`InputError`).
        """
        first = self.parts.sections[0]
        if first.inertia == 0.0:
            raise InputError(
                "a lumped spring has no impedance; describe the pipe by its geometry",
                f"drillstring.sections.{first.name}",
            )
        return first.impedance

    @property
    def top_inertia(self) -> float:
        """Inertia of the top drive J_d (kg m2)."""
        return self.parts.top_inertia

    @property
    def stick_slip_frequency(self) -> float:
        """Lowest angular frequency with the top held w_s (rad/s)."""
        return frequencies.stick_slip_frequency(self.parts)

    @property
    def drive_spring(self) -> float:
        """Spring that brings the drive to the stick-slip frequency, w_s^2 J_d (N m/rad)."""
        return self.stick_slip_frequency**2 * self.top_inertia

    @property
    def drive_damper(self) -> float:
        """Damper that takes most from string and drive together, 2 sqrt(k J_d) (N m s/rad)."""
        return float(2.0 * math.sqrt(self.static_stiffness * self.top_inertia))

    @cached_property
    def undamped_modes(self) -> tuple[Array, Array]:
        """Angular frequencies (rad/s), shape (nodes,), and mass-normalised shapes by column.

        The free-free string: the first frequency is exactly zero, its shape the rigid body, and
        no other shape has a part of it, so that a string that turns as a whole stays untwisted.
        One BLAS thread, since another count gives other bits.
        """
        import scipy.linalg
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            mass = self.mass.toarray()
            squares, shapes = scipy.linalg.eigh(self.stiffness.toarray(), mass)
            rigid = np.full(self.nodes, 1.0 / np.sqrt(mass.sum()))
            # What the eigensolver leaves is its rounding over the gap to the next mode: on a
            # short stiff string 1e-11, which its stiffness makes a torque of.
            shapes[:, 1:] -= np.outer(rigid, (rigid @ mass) @ shapes[:, 1:])
        squares[0] = 0.0
        shapes[:, 0] = rigid
        return np.sqrt(np.maximum(squares, 0.0)), shapes


class Elements(NamedTuple):
    """Elements of a string, from top to bottom, and what stands at its nodes but for the ends."""

    # shape (elements,): N m/rad, N m s/rad, kg m2, N m s/rad
    stiffness: Array
    damping: Array
    inertia: Array
    drag: Array
    # shape (nodes,): inertia (kg m2) and dampers to ground (N m s/rad)
    bodies: Array
    dampers: Array


def elements_of(sections: tuple[Section, ...]) -> Elements:
    """The elements of some sections."""
    stiffness = _per_element(sections, lambda s: s.stiffness * s.elements)
    damping = _per_element(
        sections,
        lambda s: s.coupling_damping * s.elements + s.stiffness_damping * s.stiffness * s.elements,
    )
    inertia = _per_element(sections, lambda s: s.inertia / s.elements)
    drag = _per_element(sections, lambda s: (s.mass_damping * s.inertia + s.drag) / s.elements)
    bodies, dampers = np.zeros((2, len(stiffness) + 1))
    for section, last in zip(sections, np.cumsum([s.elements for s in sections]), strict=True):
        bodies[last] += section.end_inertia
        dampers[last] += section.mass_damping * section.end_inertia + section.end_drag
    return Elements(stiffness, damping, inertia, drag, bodies, dampers)


def assemble(
    sections: tuple[Section, ...],
    top_inertia: float,
    bit_inertia: float,
    top_damping: float = 0.0,
    bit_damping: float = 0.0,
    modal_damping: float = 0.0,
    mass: Literal["consistent", "lumped"] = "consistent",
) -> Drillstring:
    """Put a string together from linear (two-node) torsional elements.

    Parameters
    ----------
    sections : tuple of Section
        From top to bottom.
    top_inertia, bit_inertia : float
        Of the top drive and of the BHA with the bit (kg m2).
    top_damping, bit_damping : float
        Viscous dampers to ground at the two ends (N m s/rad).
    modal_damping : float
        Damping ratio added to every elastic free-free mode.
    mass : {'consistent', 'lumped'}
        Mass of an element, m/6 [[2, 1], [1, 2]] or m/2 at each end.

    Returns
    -------
    Drillstring
        Frozen.
    """
    import scipy.sparse  # a third of a second that reading a design need not wait for

    made = elements_of(sections)
    ends = np.zeros((2, len(made.bodies)))
    ends[:, 0], ends[:, -1] = (top_inertia, top_damping), (bit_inertia, bit_damping)
    share = (1 / 3, 1 / 6) if mass == "consistent" else (1 / 2, 0.0)
    m = chain(made.inertia, share) + scipy.sparse.diags_array(made.bodies + ends[0])
    k = chain(made.stiffness, APART)
    ground = chain(made.drag, share) + scipy.sparse.diags_array(made.dampers + ends[1])
    c = chain(made.damping, APART) + ground
    string = Drillstring(
        depth=_depths(sections),
        node_section=_names(sections),
        mass=m.tocsr(),
        damping=c.tocsr(),
        stiffness=k.tocsr(),
        ground_damping=np.asarray(ground.sum(axis=1)).ravel(),
        element_stiffness=made.stiffness,
        element_damping=made.damping,
        classical=_classical(c.tocsr(), m.tocsr(), k.tocsr()),
        yield_torque=sections[0].yield_torque,
        parts=Parts(
            sections, top_inertia, bit_inertia, top_damping, bit_damping, modal_damping, mass
        ),
    )
    return string if modal_damping == 0.0 else _with_modal_damping(string, modal_damping)


def with_dampers(string: Drillstring, nodes: tuple[int, ...], dampers: Array) -> Drillstring:
    """A string with dampers to ground (N m s/rad) at nodes below its top, its sections cut there.

    Elements and nodes stay as they are.
    """
    added = np.zeros(string.nodes)
    np.add.at(added, list(nodes), dampers)
    pieces, first = [], 0
    for section in string.parts.sections:
        last = first + section.elements
        cuts = [first, *(int(k) for k in np.flatnonzero(added) if first < k < last), last]
        for above, below in pairwise(cuts):
            share = (below - above) / section.elements
            pieces.append(replace(
                section, elements=below - above, stiffness=section.stiffness / share,
                inertia=section.inertia * share, length=section.length * share,
                coupling_damping=section.coupling_damping / share, drag=section.drag * share,
                end_inertia=section.end_inertia if below == last else 0.0,
                end_drag=float(added[below]) + (section.end_drag if below == last else 0.0),
            ))  # fmt: skip
        first = last
    return assemble(**vars(replace(string.parts, sections=tuple(pieces))))


def _per_element(sections: tuple[Section, ...], value: Callable[[Section], float]) -> Array:
    return np.concatenate([np.full(s.elements, value(s), dtype=float) for s in sections])


APART = (1.0, -1.0)  # share of what acts on the difference of the ends of an element


def chain(values: Array, share: tuple[float, float]) -> scipy.sparse.sparray:
    """Tridiagonal sum of the element matrices `values` x [[a, b], [b, a]]."""
    import scipy.sparse

    own, other = share
    diagonal = np.zeros(len(values) + 1)
    diagonal[:-1] += own * values
    diagonal[1:] += own * values
    return scipy.sparse.diags_array([other * values, diagonal, other * values], offsets=[-1, 0, 1])


def _depths(sections: tuple[Section, ...]) -> Array:
    steps = _per_element(sections, lambda s: s.length / s.elements)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _names(sections: tuple[Section, ...]) -> tuple[str, ...]:
    return ("top drive", *(s.name for s in sections for _ in range(s.elements)))


def _classical(
    c: scipy.sparse.csr_array, m: scipy.sparse.csr_array, k: scipy.sparse.csr_array
) -> bool:
    """Caughey's condition: C M^-1 K symmetric, to rounding."""
    if c.count_nonzero() == 0:
        return True
    product = c.toarray() @ np.linalg.solve(m.toarray(), k.toarray())
    return bool(np.abs(product - product.T).max() <= 1e-10 * np.abs(product).max())


def _with_modal_damping(string: Drillstring, ratio: float) -> Drillstring:
    """Add C = M Phi diag(2 ratio omega) Phi^T M; the rigid body stays free."""
    import scipy.sparse

    frequency, shapes = string.undamped_modes
    weighted = string.mass @ shapes
    extra = (weighted * (2.0 * ratio * frequency)) @ weighted.T
    return replace(string, damping=scipy.sparse.csr_array(string.damping.toarray() + extra))
