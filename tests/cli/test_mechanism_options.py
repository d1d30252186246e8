"""Which options of `dalembert mechanism` go together: the rules name options that there are, and each is obeyed."""

from __future__ import annotations

from dataclasses import fields

import pytest

from cli.mechanism.options import RULES, Options
from tests.conftest import Dalembert
from tests.four_bars import four_bar


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.of)
def test_rules_name_options(rule):
    # --plot is every command's, and --branch all is one value of an option
    known = {field.name for field in fields(Options)} | {"plot", "every_branch"}
    named = " ".join([rule.of, rule.needs, rule.without, rule.where]).split()
    assert set(named) <= known
    assert bool(rule.needs) != bool(rule.without)


@pytest.mark.parametrize(
    ("given", "flag", "told"),
    [
        (("--flywheel", "0.02"), "--flywheel", "expected a cycle too"),
        (("--graph", "C.x"), "--graph", "expected --plot FILE too"),
        (("--vary", "links.crank.B.x=1:2:1", "--explain"), "--explain", "expected one mechanism"),
        (("--tolerance", "--check", "--branch", "1"), "--tolerance", "no --branch or --check beside it"),
        (("--fit", "a.csv", "--at", "1deg"), "--fit", "expected without --at"),
        (("--fit", "a.csv", "--draws", "5"), "--fit", "expected without --draws"),
        (("--time", "0:1:1", "--branch", "all"), "--time", "expected without --branch all"),
        (("--until", "crank=1deg"), "--until", "expected --time too"),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    dalembert: Dalembert, tmp_path, given, flag, told
) -> None:
    (tmp_path / "m.toml").write_text(four_bar())
    done = dalembert("mechanism", "m.toml", *given)
    assert (done.returncode, done.stdout) == (2, "")
    said = " ".join(done.stderr.replace("│", " ").split())
    assert flag in said
    assert told in said
