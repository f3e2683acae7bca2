"""Responses by dense solves, for tests to compare with."""

import math

import numpy as np


def solved(string, s, top=0.0, bit=0.0):
    """Top, bit, transfer both ways, pipe torque from both ends, of M, C and K."""
    m, c, k = (x.toarray() for x in (string.mass, string.damping, string.stiffness))
    forces = np.zeros((string.nodes, 2))
    forces[0, 0] = forces[-1, 1] = 1.0
    top, bit = np.broadcast_to(top, s.shape), np.broadcast_to(bit, s.shape)
    found = []
    for at, above, below in zip(s, top, bit, strict=True):
        matrix = k + at * c + at**2 * m
        matrix[0, 0] += at * above
        matrix[-1, -1] += at * below
        angle = np.linalg.solve(matrix, forces)
        link = string.element_stiffness[0] + at * string.element_damping[0]
        pipe = link * (angle[0] - angle[1])
        v = at * angle
        found.append([v[0, 0], v[-1, 1], v[-1, 0], v[0, 1], pipe[0], pipe[1]])
    return np.array(found).T


def answered(matrices, hz, slope=0.0):
    """Response of a state space, with a torque at the bit that falls by `slope`."""
    a, b, c, d = matrices
    a = a - slope * np.outer(b[:, 1], c[1])
    unit = np.eye(len(a))
    return np.array([c @ np.linalg.solve(2j * math.pi * f * unit - a, b) + d for f in hz])
