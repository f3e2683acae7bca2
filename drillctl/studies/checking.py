"""What a design asks of the studies, checked without running any."""

from __future__ import annotations

from drillctl.design import Design
from drillctl.studies.base import studies


def refuse_what_studies_would(design: Design) -> None:
    """Refuse (`InputError`) what a study would; defaults need not fit every law.

    What a check needs is imported only if the design has its table.
    """
    for study in studies().values():
        study.check(design)
