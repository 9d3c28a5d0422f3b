"""Whatever is no value of a field is refused by its name, and what is next to its border is taken.

Of numbers between borders, whole numbers, choices and flags; of objects in Python and in a study,
and of arguments of public functions. What they may hold stands in tests/records/ranges.json, for
objects beside the table of a study in which they stand.
"""

import dataclasses
import math
import re
from functools import partial

import numpy as np
import pytest
from recording import stored
from setups import LOCAL, SOLID, beta_strength, make_problem
from small_study import small_study

import stiction as st

SCOPE = {
    "st": st, "np": np, "partial": partial, "dataclasses": dataclasses, "LOCAL": LOCAL,
    "SOLID": SOLID, "PROBLEM": make_problem(), "FIELD": beta_strength(4e-3),
}  # fmt: skip
RANGES = stored("ranges")
FIELDS = [
    (eval(text, SCOPE), fields.pop("table"), fields)
    for text, fields in RANGES["fields"].items()
]
ROWS = [(one, name, valid) for one, _, fields in FIELDS for name, valid in fields.items()]
CALLED = [
    (eval(text, SCOPE), name, valid)
    for text, names in RANGES["calls"].items()
    for name, valid in names.items()
]
WHOLE, PROFILES, OPTIONAL = (RANGES[kind] for kind in ("whole", "profiles", "optional"))
OTHERS = ("1.5", "", [], {}, 1j, math.nan, -math.inf)


def borders(interval):
    low, high = interval[1:-1].split(", ")
    return float(low), float(high), interval[0] == "[", interval[-1] == "]"


def wrong_values(name, valid):
    """Values that a field does not take: of other kinds, and those just beyond its borders."""
    wrong = [*OTHERS, *([] if name in PROFILES else [[1.0]])]  # of a single node
    wrong += [] if valid[-4:] == "inf]" else [math.inf]
    if valid == "flag":
        return [*wrong, 0, 1, 1.0, np.ones(1)]
    wrong += [True, False, *([] if name in [*OPTIONAL, *PROFILES] else [None])]
    if isinstance(valid, list):
        return [*wrong, valid[0].upper(), f" {valid[0]}"]
    low, high, with_low, with_high = borders(valid)
    if name in WHOLE:
        return [*wrong, int(low) - 1, int(low) + 0.5, 7.3]
    wrong += [np.nextafter(low, -np.inf) if with_low else low, low - 1.0]
    return (
        wrong if high == np.inf else [*wrong, np.nextafter(high, np.inf) if with_high else high]
    )


def right_values(name, valid):
    """Choices, flags, and values that a field just takes, on both sides."""
    if isinstance(valid, list) or valid == "flag":
        return (True, np.False_) if valid == "flag" else valid
    low, high, with_low, with_high = borders(valid)
    if name in WHOLE:
        return [int(low), float(low), int(low) + 2, np.int32(low)]
    return [
        low if with_low else np.nextafter(low, 1.0) if low else 1e-9,
        high if with_high else np.nextafter(min(high, 1e9), 0.0),
    ]


def named(problems, name):
    pattern = re.compile(rf"(\w+\.)*{name}\b|(\w+Weakening|Load): {name} must")
    return [text for text in problems if pattern.match(text)]


@pytest.mark.parametrize(("one", "name", "valid"), ROWS)
@pytest.mark.filterwarnings("ignore")
def test_a_field_takes_what_lies_within_its_borders(one, name, valid):
    """But where it contradicts another field: then the message is of both."""
    for value in right_values(name, valid):
        refused = []
        try:
            assert getattr(dataclasses.replace(one, **{name: value}), name) == value
        except st.InputError as error:
            refused = named(error.problems, name)
        assert not refused


@pytest.mark.parametrize(
    ("call", "name", "valid"),
    [*((partial(dataclasses.replace, one), *row) for one, *row in ROWS), *CALLED],
)
@pytest.mark.filterwarnings("ignore")
def test_what_is_no_value_is_refused_by_its_name(call, name, valid):
    for wrong in wrong_values(name, valid):
        with pytest.raises(st.InputError) as caught:
            call(**{name: wrong})
        assert named(caught.value.problems, name), (wrong, str(caught.value))


@pytest.mark.parametrize("turn", range(4))
def test_all_that_is_wrong_in_a_study_is_listed_by_its_keys(turn):
    """Of all tables, and two keys of each."""
    study, wanted = small_study(), set()
    for one, key, fields in FIELDS:
        if not key:
            continue
        *above, last = key.split(".")
        table = study
        for step in above:
            table = table.setdefault(step, {})
        inner = {k: v for k, v in table.get(last, {}).items() if isinstance(v, dict)}
        simple = (str, int, float)
        table[last] = {k: v for k, v in vars(one).items() if isinstance(v, simple)} | inner
        wanted = {name for name in wanted if not name.startswith(f"{key}.")}
        for number in {turn % len(fields), (turn + 1) % len(fields)}:
            name, valid = list(fields.items())[number]
            wrong = [x for x in wrong_values(name, valid) if isinstance(x, str | float)]
            table[last][name] = wrong[turn % len(wrong)]
            wanted.add(f"{key}.{name}")
    with pytest.raises(st.InputError) as caught:
        st.Study.from_dict(study)
    said = str(caught.value)
    for key in wanted:
        assert key in said, said
