"""JSON as it is written: byte for byte what the standard encoder makes of the same document."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dalembert.results.text import json_elements, json_members, json_parts

DOCUMENTS = [
    {},
    {"name": "", "warnings": []},
    {
        "empty": {},
        "none": None,
        "yes": True,
        "no": False,
        "tuple": (1, 2.5),
        "nested": [[], [[]], [{}], {"a": []}],
    },
    {"numbers": [0.0, -0.0, 1e-300, 5e-324, 1 / 3, 1e22, -12, 10**20, 1.7976931348623157e308]},
    {'quoted "name" \\ ü\u2028': "line\nbreak\ttab \x01 \x7f ° µ 𝄞", "list": ["a", None, {"b": "c\n"}]},
]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_as_the_standard_encoder_has_it(document):
    expected = json.dumps(document, ensure_ascii=False, indent=1, allow_nan=False) + "\n"
    assert "".join(json_parts(document)) == expected


def test_arrays_are_lists_and_numpy_numbers_are_numbers():
    document = {"a": np.array([[1.5, 2], [3, 4]]), "b": np.float64(0.1), "c": [np.int64(7), np.bool_(True)]}
    plain = {"a": [[1.5, 2.0], [3.0, 4.0]], "b": 0.1, "c": [7, True]}
    assert "".join(json_parts(document)) == json.dumps(plain, indent=1) + "\n"


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_of_json_is_refused(number):
    for document in ({"x": number}, {"x": [{"y": [number]}]}):
        with pytest.raises(ValueError, match="JSON"):
            "".join(json_parts(document))


def test_a_list_may_come_in_parts():
    elements = [{"i": 1}, [], "two", 3.5]
    parts = [json_elements(elements[:1], first=True), json_elements(elements[1:], first=False)]
    made = "{" + json_members({"name": "n"}) + ',\n "list": [' + "".join(parts) + "\n ]\n}"
    assert made == json.dumps({"name": "n", "list": elements}, indent=1)
