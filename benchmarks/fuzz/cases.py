"""Cases for fuzzing: the worked examples, further calls that reach the other readers, and damaged command lines."""

from __future__ import annotations

import functools
import os
import shlex
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.fuzz.damage import TOKENS, damage
from cli.examples import ABOUT, EXAMPLES, describe, names

ROTORS = "rotor,name,mass_g,radius_mm,angle_deg,z_mm\na,1,9,30,60,20\na,2,6,50,210,65\n07,1,3,20,10,5\n07,2,4,25,100,70\n"
PLANES = "plane,z_mm,radius_mm,rotor\nA,0,20,a\nB,90,20,a\nA,0,25,07\nB,80,30,07\n"
WEIGHTS = "weight_N,radius_in,angle_rad\n10,1,0.5\n3,2,3\n"
RUNS = (
    "run,sensor,speed_rpm,amplitude_um_pp,phase_deg,trial_plane,trial_unbalance_g_mm,trial_angle_deg,weight\n"
    "0,1,1500,70,40,,,,1\n0,2,1500,50,120,,,,2\nA,1,1500,95,60,A,500,30,1\nA,2,1500,40,100,A,500,30,2\n"
    "B,1,1500,60,10,A;B,400;100,90;120,1\nB,2,1500,80,140,A;B,400;100,90;120,2\n"
)
RUNOUT = "sensor,amplitude_um_pp,phase_deg\n1,5,30\n2,3,200\n"
INITIAL = "run,sensor,amplitude_um,phase_deg\n0,1,70,40\n0,2,50,120\n"
STORED = (
    "sensor,speed_rpm,plane,magnitude_per_kg,phase_deg,amplitude_unit\n"
    "1,,A,2000,30,um\n1,,B,500,80,um\n2,,A,700,190,um\n2,,B,2500,60,um\n"
)
STATES = (
    "step,link,field,mass_kg,inertia_kg_m2,vx_m_s,vy_m_s,ax_m_s2,ay_m_s2,omega_rad_s,alpha_rad_s2,fx_N,fy_N,fvx_m_s,torque_N_m\n"
    "1,a,p,1,0.1,1,0,2,0,1,0,5,0,,?T\n1,b,p,2,0.2,0,1,0,3,2,1,?F,0,1,3\n1,a,q,1,0.1,0,1,2,0,2,0,5,0,,?T\n"
    "1,b,q,2,0.2,1,0,0,3,0,1,?F,0,1,3\n"
)
PARTS = (
    "part,shape,mass_kg,density_kg_m3,radius_mm,inner_radius_mm,length_mm,width_mm,height_mm,depth_mm,angle_deg,x_mm,y_mm,z_mm,"
    "axis_x,axis_y,axis_z,rx_deg,ry_deg,rz_deg,ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2\n"
    "a,point,1,,,,,,,,,10,0,0,,,,,,,,,,\nb,rod,2,,,,300,,,,,0,20,0,1,1,0,,,,,,,\nc,tube,,7850,50,40,100,,,,,0,0,30,,,,0,90,0,,,,\n"
    "d,box,3,,,,,100,50,20,,5,5,5,,,,10,20,30,,,,\ne,tensor,1,,,,,,,,,0,0,0,,,,,,,0.1,0.2,0.25,0.01\n"
    "f,sphere,-0.1,,10,,,,,,,0,0,0,,,,,,,,,,\ng,arc,1,,100,,,,,,180,0,0,50,0,1,0,,,,,,,\nh,cone,2,,30,,60,,,,,0,0,0,,,,,,,,,,\n"
    "i,plate,1,,,,,100,100,,,0,0,0,0,1,1,,,,,,,\nj,ring,1,,70,,,,,,,0,0,0,,,,,,,,,,\n"
)
BODY = 'name = "b"\nparts = "parts.csv"\nomega = [1, 2, 3]\nattitude = [1, 0.5, 0, 0]\n'
TORQUED = 'inertia = [[1, 0.1, 0], [0.1, 2, 0], [0, 0, 2.5]]\nomega = [1, 2, 3]\ntorque = [0.1, 0, 0.2]\nframe = "space"\n'
LAW = "time_s,angle_deg\n" + "".join(f"{0.1 * i:.1f},{3 * i * i}\n" for i in range(8))
DRIVEN = (
    'name = "d"\n[ground]\nA = [0, 0]\nD = [4, 0]\n[links.crank]\npoints = { A = [0, 0], B = [1, 0] }\nmass = 1\ncenter = [0.5, 0]\n'
    "[links.rod]\npoints = { B = [0, 0], C = [4, 0], E = [2, 1] }\nmass = 2\ninertia = 0.1\n[links.rocker]\n"
    'points = { D = [0, 0], C = [3, 0] }\n[input]\nlink = "crank"\nlaw = "law.csv"\n[guess]\nat = "0 deg"\nrod = "60 deg"\n'
    'rocker = "100 deg"\n[[springs]]\nbetween = ["rod.E", "ground.D"]\nstiffness = 100\nfree_length = 1\ndamping = 2\n'
    '[[torsion_springs]]\nlinks = ["rod", "rocker"]\nstiffness = 3\nfree_angle = 0.5\n[[motors]]\ncarrier = "rod"\ndrives = '
    '"rocker"\nmass = 0.5\ncenter = [1, 0]\n[[friction]]\njoint = "C"\ncoefficient = 0.1\nradius = 0.01\n[[torques]]\nlink = "rocker"\n'
    'torque = 5\n[[forces]]\nlink = "rod"\npoint = "E"\nforce = [1, 2]\nframe = "link"\n'
)
STEADY = DRIVEN.replace('law = "law.csv"', 'angle = "0 deg"\nspeed = 10\nacceleration = 0')
CASES = "crank_deg,links.rod.mass_kg\n10,1\n20,2\n"
TOLERANCES = '[tolerances]\n"links.crank.B.x" = "1 mm"\n"links.rod.C" = 0.01\n'
TARGET = "E_x_m,E_y_m\n1.5,2\n1,2.2\n"
TURNS = "turned_deg,unbalance_g_mm,angle_deg\n0,209.8,50.6\n90,216.1,85.7\n180,107.9,109.6\n270,91.2,31.2\n"
SIGNAL = "t_s,mark,A_um\n" + "".join(f"{i / 100},{int(i % 10 == 0)},{(i % 10 - 5) ** 2}\n" for i in range(60))
GRAVITY = "gravity = [0, -9.81]\n"

# command line -> its files; the examples have theirs
FURTHER: list[tuple[str, dict[str, str]]] = [
    ("balance rotors.csv --planes planes.csv --round-mass 0.1g", {"rotors.csv": ROTORS, "planes.csv": PLANES}),
    ("balance weights.csv --plane A:20mm --permissible 30g_mm", {"weights.csv": WEIGHTS}),
    ("field runs.csv --runout runout.csv --reading-error 2%,2deg", {"runs.csv": RUNS, "runout.csv": RUNOUT}),
    ("field runs.csv --objective minimax --max-mass A=5g_m --max-residual 90um --save-influence out.csv", {"runs.csv": RUNS}),
    ("field runs.csv --report out.html --grade G6.3 --speed 3000rpm --rotor-mass 100kg --radius 100mm", {"runs.csv": RUNS}),
    ("field initial.csv --influence stored.csv --ridge 0.1 --blades 8", {"initial.csv": INITIAL, "stored.csv": STORED}),
    ("trial --rotor-mass 120kg --speed 3000rpm --radius 100mm --planes 2", {}),
    ("place 5g@30deg 20g@100deg --positions 0deg,90deg,200deg --max-mass 30g", {}),
    ("place 50g@30deg --blades 12 --drill 10mm --density 7850kg_m3 --drill-point 118deg --max-depth 20mm", {}),
    ("place 50g@30deg --at-radius 20mm --to-radius 35mm --at-z 10mm --to-z 0mm:90mm --blades 8 --stock 1g,2g,5g,10g", {}),
    ("work states.csv --gravity 0,-9.81", {"states.csv": STATES}),
    ("work states.csv --ledger", {"states.csv": STATES}),
    ("body parts.csv --omega 0,4,12 --about 0,0,100mm", {"parts.csv": PARTS}),
    ("body parts.csv --shaft 0mm:300mm --speed 1200rpm --speed-rate 10rad_s2 --correct A:0mm:50mm", {"parts.csv": PARTS}),
    ("spin body.toml --time 0:1/20", {"body.toml": BODY, "parts.csv": PARTS}),
    ("spin body.toml --at 1 --at 2", {"body.toml": TORQUED}),
    ("forces driven.toml", {"driven.toml": GRAVITY + DRIVEN, "law.csv": LAW}),
    ("forces driven.toml --over 0deg:360deg/24 --counterweights crank", {"driven.toml": STEADY}),
    ("mechanism driven.toml --over 0deg:360deg:30deg --set links.rod.mass=3 --branch 1", {"driven.toml": STEADY}),
    ("mechanism driven.toml --at 10deg --at 20deg --over links.crank.B.x=0.9:1.1/4 --only rod,B.x", {"driven.toml": STEADY}),
    ("mechanism driven.toml --cases cases.csv --order velocity", {"driven.toml": STEADY, "cases.csv": CASES}),
    ("inspect driven.toml --over links.crank.B.x=0.9:1.1/4", {"driven.toml": STEADY}),
    ("equilibrium driven.toml --over 0deg:360deg:1deg", {"driven.toml": GRAVITY + STEADY}),
    ("simulate driven.toml --time 0:0.2:0.1 --until 5deg --accuracy 1e-6", {"driven.toml": GRAVITY + STEADY}),
    ("tolerance driven.toml --over 0deg:90deg/3 --draws 20 --seed 3", {"driven.toml": STEADY + TOLERANCES}),
    ("fit driven.toml target.csv --want E --free links.crank.B.x=0.8:1.2 --starts 4", {"driven.toml": STEADY, "target.csv": TARGET}),
    ("index turns.csv", {"turns.csv": TURNS}),
    ("signal signal.csv --pulses 1", {"signal.csv": SIGNAL}),
    ("examples klann", {}),
]  # fmt: skip

NUMBERS = [
    "0", "-0", "1", "-1", "+2", "0.5", ".5", "5.", "1e-30", "1e30", "1e60", "1e61", "-1e60", "1e308", "1e999", "1e-320",
    "nan", "inf", "-inf", "60", "90", "180", "360", "3000", "1/3", "", "x", "1,5", "0x10", "1_0", "٣", "\u2212" + "1", "9" * 400, "9" * 5000,
]  # fmt: skip
COUNTS = [
    "0", "1", "2", "3", "7", "16", "100", "-1", "1e3", "1.5", "", "x", "1000000000", "99999999999999999999", "9" * 5000,
    "²", "٣", "20000000", "100000000",
]  # fmt: skip
UNIT = [
    "", "deg", "rad", "mm", "m", "in", "kg", "g", "lb", "N", "rpm", "rad_s", "Hz", "g_mm", "kg_m", "um", "mm_s", "s", "min", "%",
    " deg", "furlong", "°", "kg_m3", "rad_s2", "m_s2", "kg·m", "/", "_",
]  # fmt: skip
PLAUSIBLE = {
    "--order": ["position", "velocity", "acceleration", "jerk"],
    "--branch": ["all", "1", "2", "3", "99"],
    "--objective": ["minimax", "least-squares"],
    "--method": ["exact", "influence", "four-run"],  # an integration insisted upon may take its time
    "--integrator": ["DOP853", "splitting"],
    "--rotation": ["cw", "ccw"],
    "--grade": ["G2.5", "G6.3", "G0", "G-1", "G1e30", "2.5", "G"],
    "--only": ["B.x", "crank.omega", "A.jx", "crank.", "crank", "A", "B", "rod,coupler", "C", "ground", ","],
    "--set": ["links.crank.B.x=1.1", "links.rod.mass=0", "input.speed=5", "x=1", "links.crank.B.x=", "=1"],
    "--over": ["0deg:360deg:30deg", "0deg:90deg/3", "links.crank.B.x=0.9:1.1/2", "1:0:1", "crank=0:1:0", ":"],
    "--at": ["10deg", "crank=10deg", "crank=10deg,arm=2deg", "10", "x=1"],
    "--want": ["E", "rod.angle", "C.position", "ground", "."],
    "--free": ["links.crank.B.x=0.8:1.2", "links.rod.C=1:2", "gravity=0:1", "x=1:2", "links.crank.B.x=2:1"],
    "--distribution": ["normal", "uniform"],
    "--counterweights": ["crank", "coupler", "rod,crank", "ground"],
    "--flywheel": ["0.02", "1e-300", "2"],
    "--monte-carlo": ["40", "100"],
    "--pieces": ["2", "3"],
    "--max-pieces": ["2", "3"],
}
FILES = ["missing.csv", ".", "out.csv", "out.json", "-", "", "out.CSV", "out", "no/out.csv", "out.svg", "\udcff.csv", "x" * 300 + ".csv"]  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A call of the command: its arguments, the files around it, and its standard input."""

    command: str
    arguments: list[str]
    files: dict[str, bytes]
    stdin: bytes = b""


def draw(rng: np.random.Generator) -> Case:
    """Draw a call, damage one of its files or its command line or both."""
    if rng.random() < 0.6:
        known = names()
        example = known[int(rng.integers(len(known)))]
        words = shlex.split(describe(example)["command"])[1:]
        files = _files(example)
    else:
        line, texts = FURTHER[int(rng.integers(len(FURTHER)))]
        words, files = shlex.split(line), {name: text.encode() for name, text in texts.items()}
    if rng.random() < 0.97 and "--plot" in words:  # pictures take long
        place = words.index("--plot")
        del words[place : place + 2]
    command = words[0]
    if "expected.csv" in files and rng.random() < 0.5:
        words += ["--expect", "expected.csv"]
    kind = rng.random()
    if files and kind < 0.75:
        victim = sorted(files)[int(rng.integers(len(files)))]
        files[victim] = damage(rng, files[victim], victim)
    if kind > 0.65 or not files:
        for _ in range(1 if rng.random() < 0.7 else 2):
            words = _damaged_words(rng, words, sorted(files))
    if rng.random() < 0.4 and command != "examples":
        words.append("--json")
    stdin = b""
    if rng.random() < 0.1 and len(words) > 1 and words[1] in files:
        stdin, words[1] = files[words[1]], "-"
    elif rng.random() < 0.05:
        stdin = damage(rng, ROTORS.encode(), "-")
    return Case(command, [command, *map(_as_given, words[1:])], files, stdin)


def _as_given(word: str) -> str:
    """A word as a system can hand it over: no zeros, and what is no text as bytes."""
    return os.fsdecode(word.replace("\0", "").encode("utf-8", "surrogatepass"))


@functools.cache
def _of_example(example: str) -> tuple[tuple[str, bytes], ...]:
    files = [file for file in EXAMPLES.joinpath(example).iterdir() if file.name != ABOUT]
    return tuple(sorted((file.name, file.read_bytes()) for file in files))


def _files(example: str) -> dict[str, bytes]:
    return dict(_of_example(example))


@functools.cache
def _options(command: str) -> tuple[tuple[str, bool], ...]:
    """Every option of a command: its longest name, and whether it is a flag."""
    from cli.show.output import parser_of

    parsed = parser_of(command)
    return tuple(
        (max(p.opts, key=len), bool(p.is_flag)) for p in parsed.params if p.param_type_name == "option"
    )


def _pick(rng: np.random.Generator, among: Any) -> Any:
    return among[int(rng.integers(len(among)))]


def _damaged_words(rng: np.random.Generator, words: list[str], files: list[str]) -> list[str]:
    """Put one fault into a command line; the command itself stays."""
    place = int(rng.integers(1, len(words) + 1))
    options = _options(words[0])
    match int(rng.integers(9)):
        case 0 if place < len(words):
            return [*words[:place], _pick(rng, TOKENS), *words[place + 1 :]]
        case 1 if place < len(words):
            return words[:place] + words[place + 1 :]
        case 2 if place < len(words):
            return [*words[: place + 1], *words[place:]]
        case 3:
            return [*words[:place], _pick(rng, ["--nonsense", "-z", "--", "--json=1", "-h", "--help", "--version", "---"]), *words[place:]]  # fmt: skip
        case 4:  # the value of an option that is there already
            given = [i for i, word in enumerate(words[:-1]) if word.startswith("--")]
            if given:
                i = _pick(rng, given)
                return [*words[: i + 1], _value(rng, words[i], files), *words[i + 2 :]]
        case _ if options:
            name, flag = _pick(rng, options)
            if flag:
                return [*words[:place], name, *words[place:]]
            value = _value(rng, name, files)
            # a value that begins with a minus sign stands behind =
            return [*words[:place], f"{name}={value}", *words[place:]]
    return words


def _number(rng: np.random.Generator) -> str:
    return (
        str(_pick(rng, NUMBERS))
        if rng.random() < 0.5
        else f"{rng.normal() * 10.0 ** rng.integers(-3, 4):.4g}"
    )


def _quantity(rng: np.random.Generator) -> str:
    return _number(rng) + str(_pick(rng, UNIT))


def _value(rng: np.random.Generator, option: str, files: list[str]) -> str:
    """Draw an option's value: of the right form more often than not."""
    if option in PLAUSIBLE and rng.random() < 0.7:
        return str(_pick(rng, PLAUSIBLE[option]))
    unit = str(_pick(rng, ["deg", "mm", "deg", "", "s", "rad"]))
    a, b, c = (_number(rng) + unit for _ in range(3))
    match int(rng.integers(10)):
        case 0:
            return f"{a}:{b}:{c}"
        case 1:
            return f"{a}:{b}/{_pick(rng, COUNTS)}"
        case 2:
            return str(_pick(rng, COUNTS))
        case 3:
            return str(_pick(rng, [*FILES, *files]))
        case 4:
            return ",".join(_quantity(rng) for _ in range(int(rng.integers(1, 5))))
        case 5:
            return f"{_pick(rng, ['A', 'B', 'disc', '', '1', 'crank'])}{_pick(rng, ':=@')}{_quantity(rng)}{_pick(rng, [':20mm', ''])}"
        case 6:
            return str(_pick(rng, TOKENS))
        case 7:
            return f"0{unit}:360{unit}:{_pick(rng, ['1', '1e-30', '1e-6', '-1', '0', '7', '1e9'])}{unit}"
        case _:
            return _quantity(rng)
