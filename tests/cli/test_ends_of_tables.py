"""Below a long table stands what matters, and so it is seen."""

from __future__ import annotations

from tests.conftest import Dalembert


def below(text: str) -> str:
    """The last paragraph."""
    return text.rstrip().rpartition("\n\n")[2]


def test_constants_of_a_rotation(dalembert: Dalembert) -> None:
    dalembert("examples", "spinning-top")
    long = dalembert("spin", "top.toml", "--time", "0:1:0.02", "--text").stdout
    assert "nutation period" in below(long)
    assert "0.3965" in below(long)
    short = dalembert("spin", "top.toml", "--at", "1", "--text").stdout
    assert long.count("nutation period") == short.count("nutation period") == 1


def test_cycle_and_flywheel(dalembert: Dalembert) -> None:
    dalembert("examples", "crank-press")
    options = ("--over", "0deg:360deg:1deg", "--flywheel", "0.1", "--text")
    found = dalembert("forces", "press.toml", *options)
    assert found.returncode == 0, found.stderr
    assert below(found.stdout).startswith("Cycle:\n")
    assert "flywheel inertia" in below(found.stdout)


def test_verdict_on_many_rotors(dalembert: Dalembert) -> None:
    rows = "".join(f"r{k},{k + 1},20,{12 * k}\n" for k in range(30))
    call = ("balance", "-", "--plane", "A:20mm", "--round-mass", "4g", "--text", "--permissible")
    table = "rotor,mass_g,radius_mm,angle_deg\n" + rows
    # rounded to 4 g, masses of 1, 2, 3 g over a multiple are 20, 40, 20 g·mm off
    assert below(dalembert(*call, "41g_mm", stdin=table).stdout).endswith(
        "\nall 30 rotors: residual within the tolerance"
    )
    said = below(dalembert(*call, "30g_mm", stdin=table).stdout).splitlines()[-1]
    assert said == "8 of 30 rotors: residual beyond the tolerance: r1, r5, r9, r13, r17, r21, r25, r29"
