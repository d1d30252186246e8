"""`DALEMBERT_ENGINE` with a word that is no engine."""

from __future__ import annotations

import pytest

from dalembert.arithmetic.choice import EngineError, wanted
from tests.conftest import Dalembert
from tests.four_bars import four_bar
from virtualwork import Mechanism


def test_a_word_that_is_no_engine_is_one_plain_line(
    dalembert: Dalembert, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DALEMBERT_ENGINE", "foo")
    for more in (["--at", "40deg"], ["--over", "0deg:360deg:1deg"]):
        done = dalembert("mechanism", "-", *more, stdin=four_bar())
        assert done.returncode == 1
        assert done.stdout == ""
        assert done.stderr == (
            "dalembert: DALEMBERT_ENGINE=foo: there is no such engine: expected python, numpy, llvm, or nothing\n"
        )
    with pytest.raises(EngineError, match="DALEMBERT_ENGINE=foo: there is no such engine"):
        Mechanism.from_toml_text(four_bar()).motion([0.5, 0.7]).point("C").position  # noqa: B018


@pytest.mark.parametrize("word", ["", "python", "numpy", "llvm"])
def test_the_engines_and_nothing(word: str, dalembert: Dalembert, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DALEMBERT_ENGINE", word)
    assert wanted() == (word or None)
    assert dalembert("mechanism", "-", "--at", "40deg", stdin=four_bar()).returncode == 0
