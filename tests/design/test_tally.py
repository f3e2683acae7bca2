"""Tallies of drillers become strings: what is read, numbered, concluded, refused."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.optimize import brentq

import drillctl
from drillctl.design import tally_heads
from drillctl.design.tally import read
from drillctl.errors import InputError

HEADS = "Component,No. of joints,Length (m),O.D.,I.D.,Weight [lb/ft],TJ OD,TJ ID,TJ length,Grade"
LINES = f'''{HEADS},Cum. length
Bit,1,0.3,8 1/2 in,,,,,,,0.3
Bit sub,1,0.5,171 mm,71 mm,,,,,,0.8
Near bit stab,1,1.2,6 3/4 in,2 13/16 in,,,,,,2.0
Motor,1,7.2,171 mm,90 mm,,,,,,9.2
Sub,1,0.4,171 mm,71.4 mm,,,,,,9.6
Filter,1,0.4,6.75 in,71.4 mm,,,,,,10.0
MWD,1,8.5,171 mm,100 mm,,,,,,18.5
Collar,9,9.1,6 3/4 in,,100.5,,,,4145H,
HWDP,6,9.3,"5""",3 in,49.3 lb/ft,6 5/8 in,3 1/16 in,48 in,,
Jar,1,9.6,165 mm,70 mm,,,,,,
HWDP,12,9.3,5 in,3 in,49.3,6 5/8 in,3 1/16 in,48 in,,
Drill pipe,120,31 ft,5 in,4.276 in,19.5,6 5/8 in,2 3/4 in,21 in,S-135,
Drill pipe,300,31',127 mm,108.6 mm,19.5,6 5/8 in,2 3/4 in,21 in,G105,
'''
"""Like those of public simulators: cells with their own units, lines of one name, short pieces."""

INCH, FOOT = 0.0254, 0.3048
# From the top: pieces, length, outer and inner diameter, tool joint (length, outer, inner); in m.
STRING = [
    (300, 31 * FOOT, 0.127, 0.1086, (21 * INCH, 6.625 * INCH, 2.75 * INCH)),
    (120, 31 * FOOT, 0.127, 4.276 * INCH, (21 * INCH, 6.625 * INCH, 2.75 * INCH)),
    (12, 9.3, 0.127, 3 * INCH, (48 * INCH, 6.625 * INCH, 3.0625 * INCH)),
    (1, 9.6, 0.165, 0.07, None),
    (6, 9.3, 0.127, 3 * INCH, (48 * INCH, 6.625 * INCH, 3.0625 * INCH)),
    (9, 9.1, 6.75 * INCH, 0.0716727, None),
    (1, 8.5, 0.171, 0.1, None),
    (1, 0.4, 6.75 * INCH, 0.0714, None),
    (1, 0.4, 0.171, 0.0714, None),
    (1, 7.2, 0.171, 0.09, None),
    (1, 1.2, 6.75 * INCH, 2.8125 * INCH, None),
    (1, 0.5, 0.171, 0.071, None),
    (1, 0.3, 8.5 * INCH, 0.0, None),
]


def torque_at_the_bit(omega):
    """Of a string held at the top, per torque there: transfer matrices, each joint resolved."""
    angle, torque = np.zeros_like(omega), np.ones_like(omega)
    for count, length, outer, inner, joint in STRING:
        pieces = [(length - (joint[0] if joint else 0.0), outer, inner)]
        pieces += [joint] if joint else []
        for _ in range(count):
            for run, od, bore in pieces:
                moment = np.pi / 32 * (od**4 - bore**4)
                phase = omega * run / np.sqrt(79.3e9 / 7850.0)
                zeta = omega * moment * np.sqrt(79.3e9 * 7850.0)
                angle, torque = (
                    np.cos(phase) * angle + np.sin(phase) / zeta * torque,
                    np.cos(phase) * torque - zeta * np.sin(phase) * angle,
                )
    return torque


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("tally")
    (place / "tally.csv").write_text(LINES, encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def new(folder):
    """`drillctl new` with this tally: what it says, and what it wrote."""
    words = ("new", "my-rig", "--tally", "tally.csv", "--from", "bit")
    done = subprocess.run(
        [sys.executable, "-m", "drillctl", *words],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout, drillctl.load(folder / "my-rig.toml")


def test_frequencies_are_those_of_transfer_matrices_without_any_editing(new):
    _, design = new
    computed = [mode.frequency_hz for mode in drillctl.modes(design).fixed_top[:5]]
    omega = np.linspace(0.05, 12.0, 240)
    values = torque_at_the_bit(omega)
    exact = [
        brentq(torque_at_the_bit, low, high, xtol=1e-5) / (2 * np.pi)
        for low, high, a, b in zip(omega, omega[1:], values, values[1:], strict=False)
        if a * b < 0.0
    ]
    np.testing.assert_allclose(computed, exact[:5], rtol=3e-3)


def test_how_each_column_was_read_is_told(new):
    said, design = new
    for head, field in (("O.D.", "od"), ("TJ length", "joint length"), ("Cum. length", "not used")):
        assert any(head in line and field in line for line in said.splitlines())
    assert "line 9, Collar: no inner diameter: 71.7 mm by its weight" in said
    assert "'HWDP' once more: called 'HWDP 2'" in said
    names = [section.name for section in design.tables.drillstring.sections]
    assert (names[0], names[1], names[-1]) == ("Drill pipe", "Drill pipe 2", "Bit")
    assert design.tables.bha.inertia == 0.0


def test_what_is_written_carries_damping_with_its_reason(new, folder):
    _, design = new
    text = (folder / "my-rig.toml").read_text(encoding="utf-8")
    assert "# Typical internal damping" in text
    assert {x.stiffness_damping for x in design.string.parts.sections} == {1e-3}
    invented = [line for line in text.splitlines() if line.endswith('kg*m^2"') or "a1 =" in line]
    assert all("typical" in line for line in invented)


@pytest.mark.parametrize(
    ("lines", "same"),
    [
        ("name;count;length [m];OD [mm];ID [mm]\np;2;9,5;127;108,6\n", "delimiter and comma"),
        ("name,count,length,od,id\n,,m,mm,mm\np,2,9.5,127,108.6\n", "units in a row"),
        (
            "Item\tQty\tLength_m\tBody OD, mm\tBore mm\np\t2 jts\t9.5\t127\t108.6\n",
            "units as words",
        ),
        (
            "name,OD (mm),ID (mm),Tool joint length (m),Joint length (m),No,Weight kg\n"
            'p,127,"108,6",,"9,5",2,99\n',
            "length of a joint",
        ),
        ("#,Component,Total length (m),OD (mm),ID (mm),No\n1,p,19,127,108.6,2\n", "total length"),
        (
            "Well A-1\n\nOf today\nname,quantity,length per joint (m),OD,ID\n"
            "p,2,9.5 m,127 mm,108.6 mm\nTotal,,19,,\n",
            "sum",
        ),
    ],
)
def test_ways_of_writing_the_same(tmp_path, lines, same):
    (section,) = read(lines, "top", tmp_path).sections
    made = drillctl.load(
        "monteiro-trindade-2012", **{"drillstring.tally": lines, "drillstring.tally_from": "top"}
    ).string.parts.sections[0]
    assert section["name"] == "p", same
    assert made.length == pytest.approx(19.0)
    assert made.stiffness == pytest.approx(79.3e9 * np.pi / 32 * (0.127**4 - 0.1086**4) / 19.0)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("name,length,OD,ID\np,9 m,5,4 in\n", r"line 2, column 'OD': 5 has no unit.*5 in"),
        (
            "name,length [m],OD [in],ID [in]\np,9,5,5.5\n",
            r"line 2, column 'ID \[in\]': inner diameter 5.5 in is not less than the outer, 5 in",
        ),
        ('name,"length\n[m]",OD [in],ID [in]\np,9,5,4\nJar,,5,3\n', "line 4, column"),
        ("name,length [m],OD [in],ID [in]\np,9,5,4\nJar,,5,3\n", r"line 3, column 'length \[m\]'"),
        ("name,length [m],OD [in],ID [in]\np,x,5,4\n", r"line 2, column 'length \[m\]'"),
        ('name,length [ft],OD [in],ID [in]\np,"13,360",5,4\n', "13360 or 13.360"),
        ("name;length [m];OD [mm];ID [mm]\np;4.992;127,0;108,6\n", "4992 or 4.992"),
        ("name,length [m],OD [in],ID [in],count\np,9,5,4,some\n", "not a number of pieces"),
        (
            "name,length [m],bore [in]\np,9,4\n",
            r"line 1: no column is the outer diameter.*call one 'OD'",
        ),
        ("name,length [m],OD [in],diameter [in],ID [in]\np,9,5,5,4\n", "both read as od"),
        ("name,length [m],OD [in],ID [in]\np,9,5,-\n", "no inner diameter"),
        ("name,length [m],OD [in],ID [in]\np,-9,5,4\n", r"line 2, column 'length \[m\]'.*greater"),
        ("name,length [m],OD [in],ID [in]\np,0,5,4\n", r"line 2, column 'length \[m\]'.*greater"),
        ("name,OD [in],length [m],ID [in]\np,31,5,4\n", r"column 'OD \[in\]': 31 in is no outer"),
        ("name,length [m],OD [mm],ID [mm]\np,9,5,4\n", r"column 'OD \[mm\]': 5 mm is no.*unit"),
        (
            "name,length [m],OD [in],weight [ppf]\nDC,9,6.5,300\n",
            r"line 2, column 'weight \[ppf\]': 300 ppf is more than a solid bar",
        ),
        (
            "name,length [m],OD [in],ID [in]\nbit,0.3,8.5,0\np,9,5,4\n",
            "first line.*begin at the top",
        ),
    ],
)
def test_what_cannot_be_read_is_named_by_line_and_column(tmp_path, lines, message):
    path = tmp_path / "tally.csv"
    path.write_text(lines, encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        read(str(path), "top", tmp_path)
    assert str(path) in str(caught.value)


def test_the_end_it_begins_at_is_told_never_guessed(folder):
    with pytest.raises(InputError, match=r'tally_from: is missing.*"top" or at the "bit"'):
        read("tally.csv", None, folder)


def test_a_workbook_is_read_like_its_lines(tmp_path, folder):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (("name", "length [m]", "OD [in]", "ID [in]"), ("p", 9.5, "4 1/2", 3.826)):
        book.active.append(row)
    book.save(tmp_path / "tally.xlsx")
    (section,) = read("tally.xlsx", "top", tmp_path).sections
    assert section == {
        "name": "p", "length": "9.5 m", "outer_diameter": "4 1/2 in", "inner_diameter": "3.826 in",
    }  # fmt: skip


def test_a_section_of_the_design_is_laid_over_that_of_its_tally(folder):
    path = folder / "laid.toml"
    path.write_text(
        'schema = 1\nmodel = "monteiro-trindade-2012"\n[drillstring]\ntally = "tally.csv"\n'
        'tally_from = "bit"\n[[drillstring.sections]]\nname = "Jar"\ninertia = "2 kg*m^2"\n',
        encoding="utf-8",
    )
    sections = drillctl.load(path).tables.drillstring.sections
    assert len(sections) == 13  # those of the model are gone
    assert {x.name: x.inertia for x in sections if x.inertia} == {"Jar": 2.0}


@pytest.mark.parametrize("name", ["typical-land", "typical-offshore", "typical-slim"])
def test_a_new_rig_like_a_typical_one(name, tmp_path, monkeypatch):
    from drillctl.design.reading import write_starter

    monkeypatch.chdir(tmp_path)
    mine, model = drillctl.load(write_starter("mine", like=name)), drillctl.load(name)
    assert mine.tables.title == "mine"
    assert mine.string.parts == model.string.parts
    assert model.tables.status == "typical"
    assert not model.warnings
    (tmp_path / "no.text").write_bytes(b"\xff")
    with pytest.raises(InputError, match="not UTF-8 text"):
        write_starter("other", like="no.text")


PIPE = {"name": "Drill pipe", "pipe": "5 in 19.5 lb/ft", "tool_joints": True}


@pytest.mark.parametrize(
    ("lines", "first"),
    [
        (  # heads in two rows, of merged cells
            "BHA 7,,,,,,,\nComponent,Body,,,Tool joint,,,Count\n"
            ",OD (in),ID (in),Length (ft),OD (in),ID (in),Length (in),\n"
            "Drill pipe,5,4.276,31.0,6.625,2.75,21,300\nBit,8.5,,1,,,,1\n",
            {"name": "Drill pipe", "repeat": 300, "length": "31.0 ft", "outer_diameter": "5 in",
             "inner_diameter": "4.276 in", "joint_outer_diameter": "6.625 in",
             "joint_inner_diameter": "2.75 in", "joint_length": "21 in"},
        ),
        (  # units under the heads, lines counted, blank lines, a length of all pieces, a sum
            "BHA #7,,,,,,\n,,,,,,\nItem,Description,Qty,OD,ID,Length,Weight\n,,(jts),(in),(in),"
            '(m),(lb/ft)\n1,Drill pipe,100,5,4.276,950,19.5\n\n2,"8-1/2"" PDC bit",1,8½,-,0.28,\n'
            ",Total,,,,950.28,\n",
            {**PIPE, "repeat": 100, "length": "9.5 m"},
        ),
        (  # stands
            "Name,Stands,Length (m),OD,ID\nDrill pipe,100,28.5,5″,4.276\"\nBit,1,0.3,8.5 in,\n",
            {**PIPE, "repeat": 100, "length": "28.5 m", "joint_spacing": "9.5 m"},
        ),
        (  # diameters by name alone, the grade in it
            "Description,Joints,Total length (m)\nDrill pipe 5 in 19.5# G-105,300,2850\n"
            "Bit 8 1/2 in,1,0.3\n",
            {**PIPE, "name": "Drill pipe 5 in 19.5# G-105", "repeat": 300, "length": "9.5 m",
             "grade": "G-105"},
        ),
        (  # a comma as the decimal point, points between thousands
            "Name;OD (mm);ID (mm);Length (ft)\nDrill pipe;127,0;108,6;9.350,5\nBit;216;;1\n",
            {**PIPE, "length": "9350.5 ft"},
        ),
        (  # feet and inches; a total without a name; the same length twice
            "Name,OD,ID,Length (ft),Length (m)\nDrill pipe,5 in,4.276 in,31' 6\",9.6\n"
            "Bit,8.5 in,,1,0.3\n,,,32.5,9.9\n",
            {**PIPE, "length": "31' 6\""},
        ),
        (  # capitals
            "NO.,ITEM,QTY,LENGTH (M),OD (IN),ID (IN)\n1,Drill pipe,300,9.45,5,4.276\n"
            "2,BIT,1,0.3 M,8.5 INCH,\n",
            {**PIPE, "repeat": 300, "length": "9.45 M"},
        ),
        (  # capitals under the heads
            "ITEM,LENGTH,OD,ID\n,M,MM,MM\nDrill pipe,950,127,108.6\nBIT,0.3,215.9,\n",
            {**PIPE, "length": "950 M"},
        ),
        (  # lines of a table in a text
            "| Name | OD (in) | ID (in) | Length (m) |\n|---|:--|---|---|\n"
            "| Drill pipe | 5 | 4.276 | 2 850 |\n| Bit | 8.5 | | 0.3 |\n",
            {**PIPE, "length": "2850 m"},
        ),
        (  # an average length of joints beside that of all
            "Section Type,Length (m),Length To (m),OD (in),ID (in),Average Joint Length (m)\n"
            "Drill pipe,3500,3500,5,4.276,9.14\nBit,0.3,3500.3,8.5,,\n",
            {**PIPE, "length": "3500 m", "joint_spacing": "9.14 m"},
        ),
    ],
    ids=["merged", "counted", "stands", "names", "comma", "feet", "capitals", "below", "text",
         "average"],
)  # fmt: skip
def test_tallies_as_they_are_found(tmp_path, lines, first):
    made = read(lines, "top", tmp_path)
    assert made.sections[0] == first
    assert len(made.sections) == 2
    assert made.sections[1]["inner_diameter"] == "0 mm"


@pytest.mark.parametrize("code", ["utf-8-sig", "utf-16", "cp1252"])
def test_files_as_spreadsheets_save_them(tmp_path, code):
    path = tmp_path / "tally.csv"
    path.write_bytes("Name,OD,ID,Length\nDrill pipe ½,5 in,4.276 in,9 m\n".encode(code))
    assert read("tally.csv", "top", tmp_path).sections[0]["name"] == "Drill pipe ½"


def test_a_workbook_with_a_cover_is_read_at_its_tally(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Rig tally"])
    sheet = book.create_sheet("BHA")
    for row in (
        ["BHA 7"], [], ["Component", "Body", "", "", "Qty"],
        ["", "OD (in)", "ID (in)", "Length (m)"],
        ["Drill pipe", 5, 4.276, 9.5, 300],
    ):  # fmt: skip
        sheet.append(row)
    for cells in ("A1:G1", "A3:A4", "B3:D3", "E3:E4"):
        sheet.merge_cells(cells)
    book.save(tmp_path / "tally.xlsx")
    found = read("tally.xlsx", "top", tmp_path).sections
    assert found == ({**PIPE, "repeat": 300, "length": "9.5 m"},)


def test_pipe_without_columns_for_it_has_the_joints_of_its_grade(tmp_path):
    text = "name,length [m],OD [in],ID [in],grade\nDrill pipe,950,5,4.276,S-135\n"
    made = read(text, "top", tmp_path)
    said = "tool joints: those of 5 in 19.5 lb/ft of S-135 in the catalogue"
    assert made.notes == (f"line 2, Drill pipe: {said}",)
    string = {"drillstring.tally": text, "drillstring.tally_from": "top"}
    with_joints = drillctl.load("monteiro-trindade-2012", **string).string.parts.sections[0]
    body = 7850.0 * 950.0 * np.pi / 32 * (0.127**4 - (4.276 * INCH) ** 4)
    assert with_joints.inertia == pytest.approx(1.31 * body, rel=0.01)


def test_stands_of_the_length_of_a_joint_are_refused(tmp_path):
    text = "name,stands,length [m],OD [in],ID [in]\np,100,9.5,5,4.276\n"
    with pytest.raises(InputError, match=r"line 2, column 'length \[m\]'.*not of a stand"):
        read(text, "top", tmp_path)


def test_a_column_that_counts_the_lines_names_nothing(tmp_path):
    text = "Item,Description,Length (m),OD (mm),ID (mm)\n1,Bit,0.3,216,\n2,Pipe,900,127,108.6\n"
    made = read(text, "bit", tmp_path)
    assert [one["name"] for one in made.sections] == ["Pipe", "Bit"]
    assert dict(column[:2] for column in made.columns)["Item"] == "not used"


JOINTS = {"pipe": "5 in 19.5 lb/ft", "tool_joints": True}
DP = {
    "name": "5 in DP 19.5#",
    "repeat": 300,
    "outer_diameter": "5 in",
    "inner_diameter": "4.276 in",
}


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (  # stands have a joint of pipe's tool joint, as long as the catalogue has it
            "Item #,Description,Stands,OD (in),ID (in),TJ OD (in),TJ ID (in),Length (ft)\n"
            "1,5 in DP 19.5#,300,5,4.276,6-5/8,3.5,93.0\n2,Jar,,6.5,2.75,6.5,,32\n",
            {**DP, "length": "93.0 ft", "joint_outer_diameter": "6-5/8 in", "joint_spacing":
             "9.4488 m", "joint_inner_diameter": "3.5 in", "joint_length": "0.5334 m"},
        ),
        (  # a joint's length beside the total, a weight with tool joints that is another's
            "Component,Qty,OD,ID,Adj. Weight,Joint Length,Total Length,Max TJ OD\n"
            ',,in,in,lb/ft,ft,ft,in\n5 in DP 19.5#,300,5.000,4.276,25.6,31.45,"9,435",6.625\n'
            "Float Sub,1,6.5,2.813,,2.5,2.5,\n",
            {"name": "5 in DP 19.5#", "repeat": 300, "length": "31.45 ft", **JOINTS},
        ),
        (  # numbers of stands, average beside total lengths, two diameters in a column
            "Stand No.,Component,# Jts,Avg Len/Jt (ft),OD x ID (in),TJ OD/ID (in),Length (ft)\n"
            '8,5 in DP 19.5#,300,31.6,5 x 4.276,6-5/8 X 3-1/4,"9,480.0"\n,Jar,1,,6.5 x 2.75,,32\n',
            {**DP, "length": "31.6 ft", "joint_outer_diameter": "6-5/8 in",
             "joint_inner_diameter": "3-1/4 in", "joint_length": "0.5334 m"},
        ),
        (  # a list of joints, a line each
            "Stand #,Jt #,Description,OD (in),ID (in),Length (ft),Running Total (ft)\n"
            '8,22,5 in DP 19.5#,5.000,4.276,31.1,31.1\n8,23,5 in DP 19.5#,5.000,4.276,31.2,62.3\n'
            "8,24,5 in DP 19.5#,5.000,4.276,30.7,93.0\n,,Jar,6.5,2.75,32,125\n",
            {"name": "5 in DP 19.5#", "repeat": 3, "length": "9.4488 m", **JOINTS},
        ),
        (  # German, a total that adds up from line to line, as Excel writes it
            "sep=;\nPos.;Bezeichnung;Anzahl;Länge (m);Außendurchmesser (mm);ID (mm);"
            "Gesamtlänge (m)\n"
            '1;Bohrgestänge 5";300;9,5;127;108,6;2850\n2;Schwerstange 8";6;9,1;203,2;71,4;2904,6\n'
            '3;Bohrmeißel 8 1/2";1;0,3;215,9;;2904,9\n;Summe;;;;;2904,9\n',
            {"name": 'Bohrgestänge 5"', "repeat": 300, "length": "9.5 m", **JOINTS},
        ),
        (  # Norwegian and French
            "Komponent,Antall,Lengde pr. stk (m),Ytre diameter (mm),Indre diameter (mm),"
            "Vekt (kg/m)\n"
            "Borerør,300,9.5,127,108.6,29\nBorekrone,1,0.3,216,,\n",
            {"name": "Borerør", "repeat": 300, "length": "9.5 m", **JOINTS},
        ),
        (
            "Désignation;Nombre;Longueur unitaire (m);Diamètre extérieur (mm);"
            "Diamètre intérieur (mm)\n"
            "Tiges 5in;300;9,5;127;108,6\nOutil PDC;1;0,3;216;\n",
            {"name": "Tiges 5in", "repeat": 300, "length": "9.5 m", **JOINTS},
        ),
        (
            "Name,No,L [m],D_o [mm],D_i [mm],m [kg/m]\nDP,300,9.5,127,108.6,29\nBit,1,.3,216,0,\n",
            {"name": "DP", "repeat": 300, "length": "9.5 m", **JOINTS},
        ),
        (
            "Name,Qty.,Single length (m),Ø out (mm),Ø in (mm)\nDP,300,9.5,127,108.6\n"
            "Bit,1,.3,216,0\n",
            {"name": "DP", "repeat": 300, "length": "9.5 m", **JOINTS},
        ),
    ],
    ids=["stands", "adjusted", "pairs", "joints", "German", "Norwegian", "French", "letters",
         "signs"],
)  # fmt: skip
def test_tallies_of_contractors(tmp_path, lines, expected):
    made = read(lines, "top", tmp_path)
    assert made.sections[0] == expected
    assert len(made.sections) == (3 if "Summe" in lines else 2)


def test_the_sheet_with_most_columns_is_the_tally(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["Hole", "Length [m]", "OD [in]"], ['12 1/4"', 2600, 12.25]):
        book.active.append(row)
    sheet = book.create_sheet("String")
    for row in (["Component", "Length [m]", "OD [in]", "ID [in]"], ["p", 9.5, 5, 4.276]):
        sheet.append(row)
    book.save(tmp_path / "tally.xlsx")
    made = read("tally.xlsx", "top", tmp_path)
    assert [one["name"] for one in made.sections] == ["p"]
    assert made.place.endswith("tally.xlsx, sheet 'String'")


def test_a_new_file_has_the_units_and_the_bit_of_its_tally(tmp_path, monkeypatch, capsys):
    from drillctl.cli.app import run

    monkeypatch.chdir(tmp_path)
    text = (
        "Component,Count,Length (ft),OD (in),ID (in)\nDP,300,31.0,5.0,4.276\nTricone,1,1.0,12.25,\n"
    )
    (tmp_path / "tally.csv").write_text(text, encoding="utf-8")
    assert run(["new", "mine", "--tally", "tally.csv", "--from", "top"]) == 0
    tables = drillctl.load("mine.toml").tables
    assert tables.units == "field"
    assert tables.bit_rock.bit_diameter == pytest.approx(12.25 * INCH)
    assert tables.bit_rock.bit_type == "roller-cone"
    assert 'weight_on_bit = "39 klbf"' in (tmp_path / "mine.toml").read_text(encoding="utf-8")
    # 5 in 19.5 lb/ft of the lowest grade weighs some 20.85 lb/ft with its tool joints
    said = capsys.readouterr().out
    assert "9301 ft in all, " in said
    weight = float(said.partition("ft in all, ")[2].partition(" klbf in air")[0])
    assert weight == pytest.approx(9300 * 20.85e-3, rel=0.02)


def test_a_missing_tally_is_called_by_its_option(tmp_path, monkeypatch, capfd):
    from drillctl.cli.app import run

    monkeypatch.chdir(tmp_path)
    assert run(["new", "mine", "--tally", "no.csv", "--from", "top"]) == 2
    assert "--tally: no.csv: cannot be read" in capfd.readouterr().err


def test_lengths_of_a_part_are_no_component(tmp_path):
    text = (
        "Description,Stands,Jts per stand,Footage (ft),OD (in),ID (in),Weight (ppf)\n"
        "DP,100,3,93,5.0,4.276,195\nDC,2,,90,6.5,2.25,\nBit,1,,1,8.5,,\n"
        "BHA length,,,181,,,\nTotal string,,,9481,,,\n"
    )
    made = read(text, "top", tmp_path)
    assert [one["name"] for one in made.sections] == ["DP", "DC", "Bit"]
    assert any("BHA length" in note and "a sum" in note for note in made.notes)
    assert any("195 ppf is 11 times what steel of its diameters weighs" in n for n in made.notes)


@pytest.mark.parametrize(
    ("head", "field", "unit"),
    [
        ("L (ft)", "length", "ft"),
        ("Long. (m)", "length", "m"),
        ("Long description", "name", ""),
        ("Länge je Stück [m]", "length", "m"),
        ("Section Length (ft)", "total length", "ft"),
        ("Weight/ft", "weight", "lb/ft"),
        ("lb/ft", "weight", "lb/ft"),
        ("kg / m", "weight", "kg/m"),
        ("Total Wt", "", ""),
        ("Tool Jt OD", "joint od", ""),
        ("Box OD (in)", "joint od", "in"),
        ("Conn. Type", "", ""),
        ("Ext. dia (mm)", "od", "mm"),
        ("Innen-Ø [mm]", "id", "mm"),
        ("Jnts", "count", ""),
        ("Stand #", "", ""),
        ("No. of Stands", "stands", ""),
        ("Comp.", "name", ""),
    ],
)
def test_heads_in_use(head, field, unit):
    assert tally_heads._head(head)[1:] == (field, unit)


@pytest.mark.parametrize(("name", "content"), [("t.xls", b"a,b"), ("t.csv", b"%PDF-1.7")])
def test_other_files_are_to_be_saved_as_one_that_is_read(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=f"{name}: save the sheet as .xlsx or CSV"):
        read(name, "top", tmp_path)


@pytest.mark.parametrize(
    ("name", "od", "across", "kind"),
    [
        ('8 1/2" PDC', "6.0", 8.5, "pdc"),  # its shank
        ("PDC bit, 16 mm cutters", "8.5", 8.5, "pdc"),
        ("Barrena triconica 12-1/4 in", "12.25", 12.25, "roller-cone"),
        ('Beitel 8 1/2"', "8.5", 8.5, None),
    ],
)
def test_the_bit_is_as_wide_as_its_name_says(tmp_path, name, od, across, kind):
    quoted = name.replace('"', '""')
    text = f'name,length [m],OD [in],ID [in]\nTubería,900,5,4.276\n"{quoted}",1,{od},\n'
    made = read(text, "top", tmp_path)
    assert made.bit[0] == pytest.approx(across * INCH)
    assert made.bit[1] == kind
    assert made.sections[0]["tool_joints"]


def test_a_tally_without_names_is_told_so(tmp_path):
    made = read("What;length [m];OD [in];ID [in]\nDP;9;5;4.276\nDC;9;6.5;2.25\n", "top", tmp_path)
    assert "call one 'Name'" in made.notes[0]


def test_a_tally_with_its_own_units_waits_for_no_library_of_units(new, folder):
    script = "import sys, drillctl\ndrillctl.load('my-rig.toml')\nassert 'pint' not in sys.modules"
    subprocess.run([sys.executable, "-c", script], cwd=folder, check=True)
