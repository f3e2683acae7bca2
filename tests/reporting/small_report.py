"""A small design whose report takes seconds, with a title and notes that are no markup."""

from __future__ import annotations

from dataclasses import replace

import drillctl
from drillctl.design import Design
from drillctl.reporting import QUICK

TITLE = '<script>alert(1)</script> & "quotes"'
NOTES = ("<b>bold</b> | * _ ` " * 250)[:5000]
TINY = replace(QUICK, setting=64, audited=1)


def small_design(**values: object) -> Design:
    """The paper's case on a few cells and draws."""
    return drillctl.load(
        "monteiro-trindade-140kn",
        **{
            "title": TITLE,
            "notes": NOTES,
            "map.axes": [
                {"path": "controller.kp", "min": 400, "max": 800, "points": 5},
                {"path": "controller.ki", "min": 50, "max": 200, "points": 4},
            ],
            "map.audit_cells": 1,
            "drillstring.sections.pipe.elements": 10,
            "uncertainty.realizations": 16,
            **values,
        },
    )
