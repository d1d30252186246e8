"""`--report`: pages to be handed on, of every command."""

from __future__ import annotations

import csv
import html.parser
import io
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from cli.examples import describe, names
from dalembert.results.report import WIDE
from tests.conftest import Dalembert

HEAD = (
    "--about",
    "title=Bericht <7>",
    "--about",
    "machine=Fan & Söhne",
    "--about",
    "customer=C",
    "--about",
    "author=K. T.",
)
EXAMPLES = {
    "balance": "riul-rotor",
    "field": "pump-trials-left-on",
    "place": "blades",
    "mechanism": "klann",
    "forces": "toggle-clamp",
    "work": "riul-slider-crank",
    "body": "riul-rod",
    "spin": "tennis-racket",
}


class Read(html.parser.HTMLParser):
    """What stands in a page: texts by tag, tables as rows of cells, and whether every element is closed."""

    VOID = ("meta", "br")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tables: list[list[list[str]]] = []
        self.texts: dict[str, list[str]] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        tag = self.open[-1] if self.open else ""
        self.texts.setdefault(tag, []).append(data)
        if tag in ("td", "th"):
            self.tables[-1][-1][-1] += data

    @property
    def cells(self) -> set[str]:
        return {cell for table in self.tables for row in table for cell in row}


def read(path: Path) -> Read:
    page = path.read_text(encoding="utf-8")
    found = Read(page)
    assert found.open == []
    assert "<script" not in page
    assert not re.search(r"""(src|href)=["']https?:""", page)
    return found


def made(dalembert: Dalembert, command: str, *options: str) -> subprocess.CompletedProcess[str]:
    example = EXAMPLES[command]
    assert dalembert("examples", example).returncode == 0
    words = [word for word in describe(example)["command"].split()[1:] if word != "--text"]
    words = words[: words.index("--plot")] if "--plot" in words else words
    done = dalembert(*words, *options)
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.parametrize("command", EXAMPLES)
def test_every_command_has_a_report(command: str, dalembert: Dalembert, tmp_path: Path) -> None:
    done = made(
        dalembert,
        command,
        "--report",
        "r.html",
        *HEAD,
        "--about",
        "date=1. 2. 2026",
        "-o",
        "out.csv",
        "--digits",
    )
    assert done.stdout == ""
    page = read(tmp_path / "r.html")
    assert page.texts["h1"] == ["Bericht <7>"]
    assert page.texts["dd"] == ["Fan & Söhne", "C", "1. 2. 2026", "K. T."]
    assert "Given" in page.texts["h3"]
    assert page.open == []
    assert (tmp_path / "r.html").read_text().count("<svg ") >= 1
    *_, method, call = page.texts["p"]
    assert len(method) > 80
    assert re.match(rf"dalembert \d\S*: dalembert {command} ", call)
    # the numbers are those of the CSV, to six digits
    columns = list(csv.reader(io.StringIO((tmp_path / "out.csv").read_text())))[1:]
    numbers = {f"{float(c):.6g}" for row in columns for c in row if re.fullmatch(r"-?\d+\.\d+(e.*)?", c)}
    sizes = {n for n in numbers if abs(float(n)) > 1e-9}
    assert len(sizes & page.cells) >= min(len(sizes), 20) * 0.8


FOUR_BAR = """ground, input, R, 0, 0
input, coupler, R, -2, 0
coupler, rocker, R, 5, 6
ground, rocker, R, 4, 0
coupler, R, 7, 7
"""
WRITERS = {
    "import": ("import", "bar.txt", "-o", "bar.toml"),
    "export": ("export", "klann.toml", "--at", "90deg", "-o", "leg.urdf"),
    "an example": ("examples", "klann"),
    "the examples": ("examples",),
}


@pytest.mark.parametrize("form", ["html", "md"])
@pytest.mark.parametrize("what", WRITERS)
def test_what_is_written_for_others_has_a_report(
    what: str, form: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    dalembert("examples", "klann")
    (tmp_path / "bar.txt").write_text(FOUR_BAR)
    done = dalembert(*WRITERS[what], "--report", f"r.{form}", *HEAD)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / f"r.{form}").read_text(encoding="utf-8")
    if form == "md":
        assert text.startswith("# Bericht \\<7\\>\n\n- machine: Fan & Söhne\n- customer: C\n- date: 20")
        assert (tmp_path / "r.svg").is_file() == (what in ("import", "export"))
        return
    page = read(tmp_path / "r.html")
    assert page.texts["h1"] == ["Bericht <7>"]
    assert re.match(rf"dalembert \d\S*: dalembert {WRITERS[what][0]}", page.texts["p"][-1])
    assert text.count("<svg ") == (what in ("import", "export"))
    rows = {row[0]: row for table in page.tables for row in table}
    if what == "import":
        # the drawn pose, and the file that was made
        assert rows["J3"][-2:] == ["5", "6"]
        assert rows["coupler"][1] == "0"
        assert (tmp_path / "bar.toml").read_text().strip() in "".join(page.texts["pre"])
        # warnings come last
        assert page.texts["h3"][-1] == "Warnings"
        assert any("numbers are taken as metres" in said for said in page.texts["p"][-4:])
    elif what == "export":
        assert rows["B"][-2:] == ["0", "210"]  # the crank of 120 mm, upright on its pin at (0, 90)
        assert rows["crank"][1] == "90"
        assert any("leg.urdf: robot (URDF)" in said for said in page.texts["p"])
    else:
        named = [name for name in page.texts["h3"] if name != "Given"]
        assert named == (["klann"] if what == "an example" else names())
        assert describe("klann")["command"] in page.texts["pre"]


def test_a_report_is_not_written_over_what_was_read(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "bar.md").write_text(FOUR_BAR)
    done = dalembert("import", "bar.md", "-o", "bar.toml", "--report", "bar.md")
    assert done.returncode == 2
    assert "is an input" in done.stderr
    assert not (tmp_path / "bar.toml").exists()
    assert (tmp_path / "bar.md").read_text() == FOUR_BAR
    assert dalembert("import", "bar.md", "--about", "machine=M").returncode == 2


@pytest.mark.parametrize("command", EXAMPLES)
def test_as_markdown_with_its_picture_beside(command: str, dalembert: Dalembert, tmp_path: Path) -> None:
    made(dalembert, command, "--report", "r.md", *HEAD, "-o", "out.csv")
    text = (tmp_path / "r.md").read_text(encoding="utf-8")
    assert text.startswith("# Bericht \\<7\\>\n\n- machine: Fan & Söhne\n- customer: C\n- date: 20")
    pictures = re.findall(r"!\[.*\]\(<(.*)>\)", text)
    assert pictures[0] == "r.svg"
    for name in pictures:
        assert (tmp_path / name).read_text().startswith("<svg ")
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) > 2
    for above, line in zip(text.splitlines(), text.splitlines()[1:], strict=False):
        if above.startswith("|") and line.startswith("|"):
            assert len(re.findall(r"(?<!\\)\|", above)) == len(re.findall(r"(?<!\\)\|", line))


def test_no_table_is_wider_than_the_page(dalembert: Dalembert, tmp_path: Path) -> None:
    for command in ("mechanism", "spin"):
        made(dalembert, command, "--report", "r.html", "-o", "out.csv")
        for table in read(tmp_path / "r.html").tables:
            header, *rows = table
            words = [
                max(map(len, [*head.split(), *column]))
                for head, column in zip(header, zip(*rows, strict=True), strict=True)
            ]
            assert sum(words) + 2 * (len(words) - 1) <= WIDE or len(words) <= 2


def test_a_sweep_is_thinned_and_said_so(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "toggle-clamp")
    options = ("--over", "0deg:60deg/999", "--report", "r.html", "-o", "out.csv")
    assert dalembert("forces", "clamp.toml", *options).returncode == 0
    page = read(tmp_path / "r.html")
    assert "one row in 28 of 1000" in page.texts["p"]
    steps = [row[0] for row in page.tables[0][1:]]
    assert steps == [str(1 + 28 * k) for k in range(36)]


def test_the_head_may_stand_in_the_file(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "klann")
    dalembert("examples", "tennis-racket")
    table = '\n[report]\ntitle = "Leg"\nmachine = "Walker"\ndate = 2026-03-01\n'
    for command, name in (("mechanism", "klann.toml"), ("spin", "racket.toml")):
        plain = dalembert(command, name, "--json").stdout
        (tmp_path / name).write_text((tmp_path / name).read_text() + table)
        assert dalembert(command, name, "--json").stdout == plain
        done = dalembert(command, name, "--report", "r.html", "--about", "machine=Strider", "-o", "o.csv")
        assert done.returncode == 0, done.stderr
        page = read(tmp_path / "r.html")
        assert page.texts["h1"] == ["Leg"]
        assert page.texts["dd"] == ["Strider", "2026-03-01"]
        (tmp_path / name).write_text((tmp_path / name).read_text().replace("machine =", "machin ="))
        done = dalembert(command, name)
        assert done.returncode == 1
        assert f"{name}: [report]: unknown key 'machin'" in done.stderr
        assert "did you mean 'machine'?" in done.stderr
        assert done.stderr.count("\n") == 1


def test_wrong_usage(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "riul-rotor")
    balance = ("balance", "rotor.csv", "--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm")
    for options in (
        ["--report", "r.pdf"],
        ["--about", "title=T"],
        ["--about", "author=T"],
        ["--report", "r.md", "-o", "r.md"],
    ):
        done = dalembert(*balance, *options)
        assert done.returncode == 2, options
        assert not list(tmp_path.glob("r.*"))
    # the picture of a report is an output too
    (tmp_path / "rotor.svg").symlink_to("rotor.csv")
    before = (tmp_path / "rotor.csv").read_bytes()
    done = dalembert(*balance, "--report", "rotor.md")
    assert done.returncode == 2
    assert (tmp_path / "rotor.csv").read_bytes() == before
    assert not (tmp_path / "rotor.md").exists()


def test_what_the_file_holds_cannot_break_the_page(dalembert: Dalembert, tmp_path: Path) -> None:
    table = 'name,mass_g,radius_mm,angle_deg\n<script>alert(1)</script>,5,20,30\n"a|b`c*",1,10,90\n'
    options = ("--plane", "<b>:20mm", "--report")
    for name in ("r.html", "r.md"):
        assert dalembert("balance", "-", *options, name, "-o", "o.csv", stdin=table).returncode == 0
    assert "<script>alert(1)</script>" in read(tmp_path / "r.html").cells
    assert "a\\|b`c*" in (tmp_path / "r.md").read_text()


# two planes, two sensors; the corrections put on in run 3 miss by known unbalances
ALPHA = np.array([[0.4 + 0.1j, 0.12], [0.15j, -0.2 + 0.3j]])
OWN = np.array([12 * np.exp(0.5j), 9 * np.exp(-1.2j)])
MISSED = np.array([0.3 * np.exp(2j), 0.2j])


def readings(lagging: bool, last: bool = True) -> str:
    runs = [(0, 0), (10, 0), (0, 10j), tuple(MISSED - OWN)]
    lines = [
        "run,sensor,speed_rpm,amplitude_um_pk,phase_deg,trial_plane,trial_mass_g,trial_angle_deg,trial_kept"
    ]
    for k, on in enumerate(runs[: 4 if last else 3]):
        planes = [p for p, w in zip("AB", on, strict=True) if w]
        masses = ";".join(f"{abs(w):.17g}" for w in on if w)
        angles = ";".join(f"{np.degrees(np.angle(w)):.17g}" for w in on if w)
        for sensor, v in zip(("DE", "NDE"), ALPHA @ (OWN + np.array(on)), strict=True):
            phase = np.degrees(np.angle(v)) * (-1 if lagging else 1) % 360
            lines.append(
                f"{k},{sensor},1480,{abs(v):.17g},{phase:.17g},{';'.join(planes)},{masses},{angles},{'yes' if k == 3 else ''}"
            )
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("lagging", [False, True])
def test_a_predicted_run_has_the_phase_that_the_instrument_will_show(
    lagging: bool, dalembert: Dalembert, tmp_path: Path
) -> None:
    """4 µm at 30° and 2 µm/g at 100°: with 3 g at 20° the run reads 4∠30° + 6∠120° = 7.21∠86.3°, lagging −86.3°."""
    sense = -1 if lagging else 1
    rows = f"0,1,4,{30 * sense},,,\n1,1,{abs(4 + 2j)!r},{sense * float(30 + np.degrees(np.arctan2(2, 4)))!r},A,1,20\n"
    text = f"run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n{rows}"
    options = ["--phase-lag"] if lagging else []
    call = ("field", "-", *options, "--predict", "3g@20deg")
    done = dalembert(*call, "--report", "r.html", "-o", "o.csv", stdin=text)
    assert done.returncode == 0, done.stderr
    page = read(tmp_path / "r.html")
    (table,) = (t for t in page.tables if any("amplitude uncertainty" in cell for cell in t[0]))
    turn = 30 + np.degrees(np.arctan2(6, 4))
    assert [float(cell) for cell in table[1][1:3]] == pytest.approx(
        [np.hypot(4, 6), sense * turn % 360], rel=1e-4
    )
    assert not any("phase sense" in t[0] for t in page.tables if "magnitude per [g]" in t[0])
    shown = dalembert(*call, "--text", stdin=text).stdout
    assert ("the instrument shows them with the other sign" in shown) == lagging


LIMITS = ("--grade", "G6.3", "--speed", "1480rpm", "--rotor-mass", "20kg", "--radius", "200mm")


@pytest.mark.parametrize("lagging", [False, True])
def test_a_balancing_in_the_field_is_judged_by_what_was_measured_last(
    lagging: bool, dalembert: Dalembert, tmp_path: Path
) -> None:
    options = [*LIMITS, "--max-residual", "1um_pk", *(["--phase-lag"] if lagging else [])]
    text = readings(lagging)
    done = dalembert("field", "-", *options, "--report", "r.html", "-o", "o.csv", stdin=text)
    assert done.returncode == 0, done.stderr
    page = read(tmp_path / "r.html")
    assert page.texts["h3"][:3] == ["Verdict", "Vibration", "What to add now"]
    (vibration,) = (table for table in page.tables if "before [µm pk]" in table[0])
    (trim,) = (table for table in page.tables if "standing mass [g]" in table[0])
    (corrections,) = (t for t in page.tables if t[0][:2] == ["plane", "mass [g]"] and "needed" not in t[0])
    limit, planes = (table for table in page.tables if table[0][-1] == "verdict")
    at = trim[0].index("mass [g]")
    assert vibration[0][:3] == ["sensor", "speed [rpm]", "before [µm pk]"]
    for row, sensor, before, after in zip(
        vibration[1:], ("DE", "NDE"), ALPHA @ OWN, ALPHA @ MISSED, strict=True
    ):
        # as the instrument shows them
        sense = -1 if lagging else 1
        shown = [[abs(v), np.degrees(np.angle(v)) * sense % 360] for v in (before, after)]
        assert row[:2] == [sensor, "1480"]
        assert [float(cell) for cell in row[2:6]] == pytest.approx(
            [*shown[0], *shown[1]], rel=5e-4, abs=0.006
        )
    assert any("against the sense" in p for p in page.texts["p"]) == lagging
    for row, plane, own, missed in zip(corrections[1:], "AB", OWN, MISSED, strict=True):
        assert row[0] == plane
        assert float(row[1]) == pytest.approx(abs(own), rel=1e-5)
        assert planes[1 + "AB".index(plane)][2:] == [
            f"{abs(own) * 200:.6g}",
            f"{abs(missed) * 200:.6g}",
            "within",
        ]
        assert float(trim[1 + "AB".index(plane)][at]) == pytest.approx(abs(missed), rel=1e-5)
        assert float(trim[1 + "AB".index(plane)][at + 1]) == pytest.approx(
            np.degrees(np.angle(-missed)) % 360, abs=1e-3
        )
    assert float(limit[1][0]) == pytest.approx(np.abs(ALPHA @ MISSED).max(), rel=1e-5)
    assert limit[1][2] == "within"
    assert any("as measured in run 3" in p for p in page.texts["p"])
    assert any("speed 1480 rpm; rotor mass 20 kg" in p for p in page.texts["p"])


def test_without_a_last_run_the_verdict_is_on_the_prediction(dalembert: Dalembert, tmp_path: Path) -> None:
    options = (*LIMITS, "--max-mass", "5g", "--report", "r.html", "-o", "o.csv")
    done = dalembert("field", "-", *options, stdin=readings(lagging=False, last=False))
    assert done.returncode == 0, done.stderr
    page = read(tmp_path / "r.html")
    (planes,) = [table for table in page.tables if table[0][-1] == "verdict"]
    assert [row[-1] for row in planes[1:]] == ["beyond", "beyond"]
    share = 6.3e-3 * 20 / (1480 * np.pi / 30) / 2 * 1e6
    for row in planes[1:]:
        assert float(row[1]) == pytest.approx(share, rel=1e-5)
        # at most 5 g at 200 mm are taken off, and the rest is beyond
        assert float(row[3]) >= float(row[2]) - 1000 - 1e-3
    assert any("No run with the corrections on" in p for p in page.texts["p"])
