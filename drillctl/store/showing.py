"""How a result shows itself at a prompt and in a notebook: what its study says of it, in short."""

from __future__ import annotations

import base64
import html
import io
from collections import Counter
from typing import TYPE_CHECKING, Any

from drillctl import registry, units
from drillctl.errors import InputError, nearest

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from drillctl.store.tables import Table

MOST_LINES, WIDTH = 10, 110  # of a text; rows of the table in a notebook are twice as many
DPI = 60  # of a small picture


def study_of(result: Any) -> Any:
    """The study that computes results of this kind."""
    return registry.resolve("drillctl.studies.base:studies")()[result.kind]


def units_of(result: Any) -> units.System:
    """Units that its design is read in."""
    system: units.System = result.design.tables.units or "si"
    return system


def _title(result: Any) -> str:
    return f"{type(result).__name__}: {result.design.tables.title or result.design.name}"


def _first_table(result: Any) -> Table | None:
    return next((one for one in study_of(result).tables(result) if one.shown), None)


def in_lines(result: Any) -> str:
    """Its name and the first table of its study, in at most ten lines."""
    lines, system, table = [_title(result)], units_of(result), _first_table(result)
    if table is not None:
        rows = [table.heads(system), *table.texts(system)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        told = [
            "  ".join(
                cell.rjust(width) if k else cell.ljust(width)
                for k, (cell, width) in enumerate(zip(row, widths, strict=True))
            ).rstrip()
            for row in rows
        ]
        room = MOST_LINES - 2
        if len(told) > room:
            told[room - 1 :] = [f"and {len(told) - room + 1} more rows: .summary(), .plot()"]
        lines += [table.said(system), *told]
    cut = (line if len(line) <= WIDTH else f"{line[: WIDTH - 1]}…" for line in lines)
    return "\n".join(cut)


def in_html(result: Any) -> str:
    """Its name, the first table of its study, and its first picture, small."""
    system, table = units_of(result), _first_table(result)
    parts = [f"<strong>{html.escape(_title(result))}</strong>"]
    if table is not None:
        heads = "".join(f"<th>{html.escape(head)}</th>" for head in table.heads(system))
        texts = table.texts(system)
        rows = "".join(
            f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>"
            for row in texts[: 2 * MOST_LINES]
        )
        more = f"<div>and {n} more rows</div>" if (n := len(texts) - 2 * MOST_LINES) > 0 else ""
        caption = html.escape(table.said(system))
        parts.append(
            f"<table><caption>{caption}</caption><thead><tr>{heads}</tr></thead>"
            f"<tbody>{rows}</tbody></table>{more}"
        )
    first = next(iter(study_of(result).pictures(result)), None)
    if first is not None:
        drawn = io.BytesIO()
        first.draw(system).savefig(drawn, dpi=DPI, format="png")
        held = base64.b64encode(drawn.getvalue()).decode()
        alt = html.escape(first.alt, quote=True)
        parts.append(f'<img src="data:image/png;base64,{held}" alt="{alt}">')
    return f"<div>{''.join(parts)}</div>"


def figure_of(result: Any, name: str | None, system: units.System | None) -> Figure:
    """One of the pictures of its study, by default the first."""
    pictures = {one.name: one for one in study_of(result).pictures(result)}
    if not pictures:
        raise InputError(f"a result of {result.kind} has no picture", "plot")
    if name is None:
        name = next(iter(pictures))
    if name not in pictures:
        raise InputError(f"no picture {name!r}; {nearest(name, list(pictures))}", "plot")
    figure: Figure = pictures[name].draw(system or units_of(result))
    return figure


def frame_of(result: Any, dims: tuple[str, ...]) -> pandas.DataFrame:
    """Its arrays over some dimensions as columns."""
    data = result.data
    over = Counter(one.dims for one in data.data_vars.values() if one.dims)
    if not over:
        raise InputError(f"a result of {result.kind} has no arrays; use .summary()", "to_dataframe")
    chosen = dims or over.most_common(1)[0][0]
    if chosen not in over:
        known = ", ".join(" x ".join(one) for one in over)
        raise InputError(f"no arrays over {' x '.join(dims)}; there are: {known}", "to_dataframe")
    kept = data[[name for name, one in data.data_vars.items() if one.dims == chosen]]
    frame: pandas.DataFrame = kept.to_dataframe()
    names = {*kept.data_vars, *kept.coords}
    frame.attrs["units"] = {str(name): data[name].attrs.get("units", "") for name in names}
    return frame
