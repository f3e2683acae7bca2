"""A drive law as text: IEC 61131-3 structured text and its PLCopen XML, C, JSON, CSV."""

from __future__ import annotations

import csv
import io
import json
import textwrap
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from typing import Any, NamedTuple
from xml.etree import ElementTree

import drillctl
from drillctl.studies.export.law import PARAMETERS, TRUTH, VARIABLES, Block, DriveLaw, Symbol
from drillctl.studies.export.terms import Term

SYMBOLS = {one.name: one for one in PARAMETERS.values()} | VARIABLES
WIDTH = 92  # of a line of a comment


class Language(NamedTuple):
    """How terms are written in a language."""

    number: Callable[[float], str]
    calls: Mapping[str, str]  # by the kind of a term, with the texts of its parts


def _lreal(value: float) -> str:
    digits = repr(value).upper()
    mantissa, _, power = digits.partition("E")
    if "." not in mantissa:
        mantissa += ".0"
    return f"LREAL#{mantissa}E{int(power)}" if power else f"LREAL#{mantissa}"


STRUCTURED_TEXT = Language(_lreal, {
    "min": "MIN({0}, {1})", "max": "MAX({0}, {1})", "abs": "ABS({0})", "exp": "EXP({0})",
    "limit": "LIMIT({0}, {1}, {2})", "choose": "SEL({0}, {2}, {1})",
})  # fmt: skip
C = Language(repr, {
    "min": "fmin({0}, {1})", "max": "fmax({0}, {1})", "abs": "fabs({0})", "exp": "exp({0})",
    "limit": "fmin(fmax({1}, {0}), {2})", "choose": "({0} ? {1} : {2})",
})  # fmt: skip
STRENGTH = {"+": 1, "-": 1, "*": 2, "/": 2, "negative": 3}


def expression(term: Term, language: Language, name: Callable[[str], str] = str) -> str:
    """A term in a language, with as few brackets as keep the order of its operations."""

    def of(one: Term, least: int = 0) -> str:
        if one.kind == "number":
            assert one.value is not None
            text = language.number(one.value)
            return f"({text})" if one.value < 0.0 and least else text
        if one.kind == "name":
            return name(one.name)
        if one.kind in language.calls:
            return language.calls[one.kind].format(*map(of, one.parts))
        strength = STRENGTH[one.kind]
        if one.kind == "negative":
            text = f"-{of(one.parts[0], 3)}"
        else:
            # What follows is in brackets even where sums are as good: rounding is not the same.
            text = f"{of(one.parts[0], strength)} {one.kind} {of(one.parts[1], strength + 1)}"
        return f"({text})" if strength < least or (one.kind == "negative" and least) else text

    return of(term)


class Written(NamedTuple):
    """What a text says of its law beside the law."""

    law: DriveLaw
    design: str  # its name
    identity: str  # its hash
    notes: tuple[str, ...]  # sentences
    rows: tuple[tuple[Symbol, float, float, float], ...]  # value, in SI and per unit


def header(of: Written) -> Iterator[str]:
    """What a reader must know, as lines of a comment."""
    yield f"Speed controller of a top drive, written by drillctl {drillctl.__version__}"
    yield f"design: {of.design}, sha256 {of.identity}"
    for note in of.notes:
        yield ""
        yield from textwrap.wrap(note, WIDTH)
    yield ""
    width = max((len(symbol.name) for symbol, *_ in of.rows), default=0)  # no torque, no numbers
    yield f"{'symbol':{width}}  {'value':12} {'unit':16}  {'per unit':12} meaning"
    for symbol, value, _, share in of.rows:
        unit = of.law.base.unit(symbol.dimension)
        yield f"{symbol.name:{width}}  {value:<12.6g} {unit:16}  {share:<12.6g} {symbol.means}"


def structured_text(of: Written) -> str:
    """IEC 61131-3 structured text."""
    parts = ["(*", *(f"  {line}".rstrip() for line in header(of)), "*)"]
    for block in of.law.blocks:
        parts += ["", f"(* The {block.means}. *)", f"FUNCTION_BLOCK {fb_name(block)}"]
        for _, keyword, names in declared(block):
            parts += [keyword, *(f"    {_declaration(name, of.law)}" for name in names), "END_VAR"]
        parts += [body(block), "END_FUNCTION_BLOCK"]
    return "\n".join(parts) + "\n"


def fb_name(block: Block) -> str:
    """Name of a function block."""
    return f"DRILLCTL_{block.name.upper()}"


def declared(block: Block) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Kinds of variables, in XML and in text, and their names."""
    kinds = (
        ("inputVars", "VAR_INPUT", block.inputs), ("outputVars", "VAR_OUTPUT", block.outputs),
        ("localVars", "VAR", (*block.parameters, *block.memory)),
        ("tempVars", "VAR_TEMP", block.work),
    )  # fmt: skip
    return (one for one in kinds if one[2])


def _declaration(name: str, law: DriveLaw) -> str:
    kind = "BOOL" if SYMBOLS[name].dimension is TRUTH else "LREAL"
    value = f" := {_lreal(law.numbers[name])}" if name in law.numbers else ""
    return f"{name} : {kind}{value}; (* {explained(name, law)} *)"


def explained(name: str, law: DriveLaw) -> str:
    """What a symbol means, with its unit."""
    symbol = SYMBOLS[name]
    unit = law.base.unit(symbol.dimension)
    return f"{symbol.means}, {unit}" if unit else symbol.means


def body(block: Block) -> str:
    """The statements of a function block."""
    steps, idle = (
        [f"{name} := {expression(term, STRUCTURED_TEXT)};" for name, term in some]
        for some in (block.steps, block.idle)
    )
    if not idle:
        return "\n".join(steps)
    inside = [f"    {line}" for line in idle], [f"    {line}" for line in steps]
    return "\n".join(["IF NOT enable THEN", *inside[0], "ELSE", *inside[1], "END_IF;"])


def plcopen(of: Written) -> str:
    """The same as PLCopen XML, TC6 version 2.01."""
    xhtml = "http://www.w3.org/1999/xhtml"
    project = ElementTree.Element("project", {
        "xmlns": "http://www.plcopen.org/xml/tc6_0201", "xmlns:xhtml": xhtml,
    })  # fmt: skip

    def within(parent: Any, name: str, text: str = "", /, **given: str) -> Any:
        child = ElementTree.SubElement(parent, name, given)
        child.text = text or None
        return child

    written = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S")
    within(project, "fileHeader", companyName="", productName="drillctl",
           productVersion=drillctl.__version__, creationDateTime=written)  # fmt: skip
    content = within(project, "contentHeader", name=of.design)
    within(content, "Comment", "\n".join(header(of)))
    info = within(content, "coordinateInfo")
    for language in ("fbd", "ld", "sfc"):
        within(within(info, language), "scaling", x="1", y="1")
    types = within(project, "types")
    within(types, "dataTypes")
    pous = within(types, "pous")
    for block in of.law.blocks:
        pou = within(pous, "pou", name=fb_name(block), pouType="functionBlock")
        interface = within(pou, "interface")
        for kind, _, names in declared(block):
            variables = within(interface, kind)
            for name in names:
                variable = within(variables, "variable", name=name)
                truth = SYMBOLS[name].dimension is TRUTH
                within(within(variable, "type"), "BOOL" if truth else "LREAL")
                if name in of.law.numbers:
                    value = _lreal(of.law.numbers[name])
                    within(within(variable, "initialValue"), "simpleValue", value=value)
                told = within(variable, "documentation")
                within(told, "xhtml:p", explained(name, of.law))
        within(within(within(pou, "body"), "ST"), "xhtml:p", body(block))
    within(within(project, "instances"), "configurations")
    ElementTree.indent(project)
    text = ElementTree.tostring(project, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'


def c(of: Written) -> str:
    """C99: a structure for each block, a function that fills it and one that works."""
    lines = ["/*", *(f" * {line}".rstrip() for line in header(of)), " */", "#include <math.h>"]
    for block in of.law.blocks:
        name = f"drillctl_{block.name}"
        kept = (*block.parameters, *block.memory, *block.outputs)
        lines += ["", f"/* The {block.means}. */", "typedef struct {"]
        lines += [f"    double {one}; /* {explained(one, of.law)} */" for one in kept]
        lines += [f"}} {name};", "", f"void {name}_init({name} *law)", "{"]
        lines += [f"    law->{one} = {of.law.numbers.get(one, 0.0)!r};" for one in kept]
        lines += ["}", "", f"/* Returns {SYMBOLS[block.outputs[0]].means}. */"]
        given = ", ".join(
            f"{'int' if SYMBOLS[one].dimension is TRUTH else 'double'} {one}"
            for one in block.inputs
        )
        lines += [f"double {name}_step({name} *law, {given})", "{"]

        def spelled(one: str, kept: tuple[str, ...] = kept) -> str:
            return f"law->{one}" if one in kept else one

        def written(
            steps: tuple[tuple[str, Term], ...], indent: str, block: Block = block
        ) -> Iterator[str]:
            for one, term in steps:
                new = "const double " if one in block.work else ""
                yield f"{indent}{new}{spelled(one)} = {expression(term, C, spelled)};"

        if block.idle:
            lines += ["    if (!enable) {", *written(block.idle, " " * 8)]
            lines += [f"        return law->{block.outputs[0]};", "    }"]
        lines += [*written(block.steps, " " * 4), f"    return law->{block.outputs[0]};", "}"]
    return "\n".join(lines) + "\n"


def as_json(of: Written) -> str:
    """Symbols with values and units, and the statements."""
    base = of.law.base
    held: dict[str, Any] = {
        "drillctl": drillctl.__version__, "design": of.design, "sha256": of.identity,
        "notes": list(of.notes),
        "base": {"torque": base.torque, "speed": base.speed, "units": list(base.names)},
        "parameters": [
            {"name": one.name, "means": one.means, "value": value,
             "unit": base.unit(one.dimension), "si": si, "per_unit": share}
            for one, value, si, share in of.rows
        ],
        "blocks": [
            {"name": block.name, "inputs": block.inputs, "outputs": block.outputs,
             "memory": block.memory, "structured_text": body(block).splitlines()}
            for block in of.law.blocks
        ],
        "variables": {
            name: explained(name, of.law)
            for block in of.law.blocks
            for name in (*block.inputs, *block.outputs, *block.memory, *block.work)
        },
    }  # fmt: skip
    return json.dumps(held, indent=2, allow_nan=False) + "\n"


def as_csv(of: Written) -> str:
    """The table of symbols."""
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["symbol", "value", "unit", "si", "per_unit", "meaning"])
    for one, value, si, share in of.rows:
        unit = of.law.base.unit(one.dimension)
        rows.writerow([one.name, repr(value), unit, repr(si), repr(share), one.means])
    return out.getvalue()


FORMATS: Mapping[str, tuple[Callable[[Written], str], str]] = {
    "structured-text": (structured_text, "st"), "plcopen": (plcopen, "xml"), "c": (c, "c"),
    "json": (as_json, "json"), "csv": (as_csv, "csv"),
}  # fmt: skip
"""What writes a format, and how the name of its file ends."""
