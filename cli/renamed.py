"""Options that have another name now, or stand at another command: one line names the new spelling."""

from __future__ import annotations

# option -> its new spelling; of all commands
EVERYWHERE = {
    "--title": "--about title=…",
    "--machine": "--about machine=…",
    "--customer": "--about customer=…",
    "--date": "--about date=…",
    "--author": "--about author=…",
    "--html": "--page FILE.html",
}
# of the commands on a mechanism
MECHANISM = {
    "--sweep": "--over 0deg:360deg:1deg",
    "--inputs": "--cases FILE.csv",
    "--vary": "--over NAME=FROM:TO:STEP",
    "--variants": "--cases FILE.csv",
    "--change": "--set NAME=VALUE",
    "--graph": "--only NAME,... with --plot FILE",
    "--check": "dalembert inspect FILE.toml",
    "--explain": "dalembert inspect FILE.toml",
    "--forces": "dalembert forces FILE.toml",
    "--flywheel": "dalembert forces FILE.toml --flywheel 0.02",
    "--counterweights": "dalembert forces FILE.toml --counterweights LINK,...",
    "--states": "dalembert forces FILE.toml --states FILE.csv",
    "--equilibrium": "dalembert equilibrium FILE.toml",
    "--time": "dalembert simulate FILE.toml --time 0:10:0.01",
    "--accuracy": "dalembert simulate FILE.toml --accuracy NUMBER",
    "--until": "dalembert simulate FILE.toml --until INPUT=VALUE",
    "--tolerance": "dalembert tolerance FILE.toml",
    "--draws": "dalembert tolerance FILE.toml --draws N",
    "--seed": "--seed of dalembert tolerance and dalembert fit",
    "--distribution": "dalembert tolerance FILE.toml --distribution uniform",
    "--fit": "dalembert fit FILE.toml TARGET.csv",
    "--point": "dalembert fit FILE.toml TARGET.csv --want H",
    "--link": "dalembert fit FILE.toml TARGET.csv --want coupler.angle",
    "--slide": "dalembert fit FILE.toml TARGET.csv --want B.position",
    "--free": "dalembert fit FILE.toml TARGET.csv --free NAME=LOW:HIGH",
    "--weight": "dalembert fit FILE.toml TARGET.csv --weight NAME=NUMBER",
    "--starts": "dalembert fit FILE.toml TARGET.csv --starts N",
    "--best": "dalembert fit FILE.toml TARGET.csv --best N",
    "--newton": "dalembert mechanism FILE.toml --newton",
    "--order": "dalembert mechanism FILE.toml --order velocity",
}
FIELD = {
    "--signal": "dalembert signal FILE.csv",
    "--pulses": "dalembert signal FILE.csv --pulses N",
    "--suggest-trial": "dalembert trial --rotor-mass MASS --speed SPEED --radius LENGTH",
    "--planes": "dalembert trial --planes N",
}
COMMANDS = ("mechanism", "forces", "inspect", "equilibrium", "simulate", "tolerance", "fit")


def renamed(command: str, option: str) -> str | None:
    """The line about an option that a command has not; None where it never was one.

    >>> renamed("mechanism", "--sweep")
    'dalembert mechanism: --sweep is now --over 0deg:360deg:1deg'
    """
    own = MECHANISM if command in COMMANDS else FIELD if command == "field" else {}
    new = EVERYWHERE.get(option) or own.get(option)
    return None if new is None else f"dalembert {command}: {option} is now {new}"
