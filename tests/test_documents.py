"""Documents: every fault is one line with the file, the place in it, what came, what is expected, and the nearest name."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typing_extensions import TypeAliasType

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

from fuzz import run
from fuzzing.documents import ANSWER, EXPERIMENT, NOMINAL, PLAN, RESULT, RIG, TARGETS
from fuzzing.mutations import mutated

from bench.campaign import read_plan
from bench.campaign.schema import PlanDocument
from bench.cli import main
from bench.cli.schema import FOLDER, KINDS, generated, text_of
from bench.discrepancy.blind.schema import AnswerDocument
from bench.discrepancy.case.schema import NominalDocument
from bench.discrepancy.verdict import Estimate, Gap, Location, NamedEffect, Ranked, Split, Verdict
from bench.discrepancy.verdict_schema import ResultDocument, VerdictDocument
from bench.documents import Document, DocumentLimits, Listed, Number, checked, load_document
from bench.documents.derived import kind_of
from bench.errors import (
    BenchError,
    DocumentError,
    FileFormatError,
    UnknownEntryError,
    UnknownNameError,
    shortened,
)
from bench.rig.schema import RigDocument

ROOT = Path(__file__).resolve().parents[1]
MODELS: dict[str, type[Document]] = {"rig": RigDocument, "plan": PlanDocument, "nominal": NominalDocument}
SOUND = {"rig": RIG, "plan": PLAN, "nominal": NOMINAL}


def replaced(name: str, path: str, value: str) -> str:
    """The JSON text of a sound document with the entry at a path given as JSON text; taken out where that is empty."""
    document = json.loads(json.dumps(SOUND[name]))
    *way, last = (int(step) if step.isdigit() else step for step in path.split("/"))
    node = document
    for step in way:
        node = node[step]
    if value:
        node[last] = "@here"
    else:
        del node[last]
    return json.dumps(document).replace('"@here"', value)


PLACED = [
    ("rig", "timestep", '"1e-3"', "timestep: '1e-3' came; a number is expected"),
    ("rig", "timestep", "NaN", "timestep: nan came; a finite number is expected"),
    ("rig", "timestep", "1e999", "timestep: inf came; a finite number is expected"),
    ("rig", "timestep", "9" * 5000, "timestep: an integer of 5000 digits came"),
    ("rig", "timestep", "-1", "timestep: -1 came; a number above 0 is expected"),
    ("rig", "timestep", "true", "timestep: true came; a number is expected"),
    ("rig", "timstep", "1.0", "unknown entry of a rig configuration 'timstep'"),
    ("rig", "integrator", '"rk4"', "integrator: unknown integrator 'rk4'; known: Euler, RK4, implicit, implicitfast. Did you mean 'RK4'"),
    ("rig", "integrator", "[]", "integrator: [] came; one of 'RK4'"),
    ("rig", "rig", '"sdfo"', "rig: unknown rig (or path ending in .xml) 'sdfo'"),
    ("rig", "rig", "", "a rig configuration needs rig; rig missing"),
    ("rig", "name", '"a\\nb"', "name: 'a\\nb' came; one line of printable text is expected"),
    ("rig", "structure", "[1]", "structure: [1] came; a table of entries is expected"),
    ("rig", "structure/mas", "{}", "structure.mas: unknown mas 'mas'"),
    ("rig", "structure/mass/carriage", '"heavy"', "structure.mass.carriage: 'heavy' came; a number is expected"),
    ("rig", "elements/0/law", "{}", "elements[0].law: {} came; text is expected"),
    ("rig", "elements/0/law", '"gpa"', "elements[0]: unknown law 'gpa'"),
    ("rig", "elements/0/joints", "3", "elements[0].joints: 3 came; a list is expected"),
    ("rig", "elements/0/parameters/clearence", "1.0", "unknown parameter of law 'gap' 'clearence'"),
    ("rig", "elements/0/parameters/clearance", "-1.0", "elements[0]: parameter 'clearance' of law 'gap' is -1"),
    ("rig", "elements/0/parameters/clearance", "[1, 2]", "elements[0].parameters.clearance: [1, 2] came; a number is expected"),
    ("rig", "excitation/duration", "1e12", "excitation: 1e+12 s at 1000 Hz are 1e+15 samples"),
    ("rig", "excitation/signals/shaker/signals/1/amplitude", '[1, "x"]', "signals[1].amplitude[1]: 'x' came; a number is expected"),
    ("rig", "excitation/signals/shaker/signals/0/signal/type", '"multisin"', "signals[0].signal.type: unknown signal type 'multisin'"),
    ("rig", "excitation/signals/shaker/signals/0/signal/band", "[1]", "signals[0].signal.band: [1] came"),
    ("rig", "experiment", "3", "experiment: 3 came; a table of entries is expected"),
    ("plan", "records", "2.5", "records: 2.5 came; a whole number is expected"),
    ("plan", "records", "0", "records: 0 came; a number of at least 1 is expected"),
    ("plan", "rigs/0/structure", "3", "rigs[0].structure: 3 came; a table of entries is expected"),
    ("plan", "rigs/0/structure/mass/carriage", '{"unifrom": [1, 2]}', "unknown distribution 'unifrom'"),
    ("plan", "rigs/0/structure/mass/carriage", '{"uniform": [1, "2"]}', "rigs[0].structure.mass.carriage.uniform[1]: '2' came"),
    ("plan", "rigs/0/structure/mass/carriage", '"heavy"', "a number or a distribution of numbers is expected"),
    ("plan", "sensors/0/chains", "3", "sensors[0].chains: 3 came; a table of entries is expected"),
    ("plan", "excitations/0/signals/shaker/rms", "[1]", "excitations[0].signals.shaker.rms: [1] came; a number is expected"),
    ("plan", "duration", "1e9", "at most 10000000 samples a record"),
    ("plan", "records", "1e18", "at most 100000000 records can be asked for"),
    ("nominal", "parameters/mass/std", "", "parameters.mass: a nominal parameter needs std (its one-sigma"),
    ("nominal", "parameters/mass/sigma", "1", "Did you mean 'std'"),
    ("nominal", "parameters/mass/value", "1" + "0" * 400, "parameters.mass.value: an integer of 401 digits came"),
    ("nominal", "parameters/mas", '{"value": 1, "std": 0}', "parameters: unknown parameter of rig 'sdof' 'mas'"),
    ("nominal", "channels/force/Role", '"command"', "channels.force: unknown entry of a channel 'Role'"),
    ("nominal", "channels/force/role", "3", "channels.force.role: 3 came; one of 'measured'"),
    ("nominal", "channels/force/noise_std", '"0.1"', "channels.force.noise_std: '0.1' came; a number is expected"),
    ("nominal", "channels/displacment", "{}", "channels: unknown response of rig 'sdof' 'displacment'"),
    ("nominal", "channels/displacement/antialias/cutoff_hz", "-1", "channels.displacement.antialias: the antialias filter"),
    ("nominal", "channels/displacement/antialias/order", "[1]", "antialias.order: [1] came; a whole number is expected"),
    ("nominal", "load_interpolaton", '"linear"', "Did you mean 'load_interpolation'"),
    ("nominal", "starts_in_motion", '"validation"', "starts_in_motion: 'validation' came; true or false or a list is expected"),
    ("nominal", "periodic", "[{}]", "periodic[0]: {} came; text is expected"),
    ("nominal", "window_s", '"two"', "window_s: 'two' came; a number is expected"),
    ("nominal", "limits", '{"forse": 1.0}', "limits: unknown channel 'forse'"),
]  # fmt: skip


def read(name: str, file: Path) -> None:
    read_plan(file) if name == "plan" else MODELS[name].read(file)


@pytest.mark.parametrize(("name", "path", "value", "words"), PLACED, ids=lambda x: str(x)[:40])
def test_a_fault_is_told_with_its_place_what_came_and_what_is_expected(name, path, value, words, tmp_path):
    file = tmp_path / f"{name}.json"
    file.write_text(replaced(name, path, value))
    with pytest.raises(BenchError) as caught:
        read(name, file)
    told = str(caught.value)
    assert words in told
    assert "\n" not in told
    assert len(told) < 1500  # 60 known names at most, of some 20 characters each
    assert told.startswith(str(file))


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.json", "[" * 100_000, "nested too deeply"),
        ("a.json", '{"a":' * 100_000, "nested too deeply"),
        ("a.json", '{"rig": ' + "[" * 70 + "]" * 70 + "}", "nested too deeply; at most 64 levels"),
        ("a.toml", "a = " + "[" * 10_000, "nested too deeply"),
        ("a.toml", "a = " + "[" * 100_000, "line 1 has 100004 characters"),
        ("a.toml", ".".join(["a"] * 5_000) + " = 1", "nested too deeply"),
        ("a.toml", "rig = 1\ntimestep = " + "9" * 5_000, "line 2 has an integer of 5000 digits"),
        ("a.toml", 'rig = "sdof"\nrig = "joint"', "Cannot overwrite a value"),
        ("a.json", '{"rig": "sdof", "structure": {"mass": {"a": 1, "a": 2}}}', "structure.mass: the entry 'a' comes twice"),
        ("a.json", '{"rig": "\\ud800"}', "rig: '\\ud800' is no Unicode text"),
        ("a.json", '{"rig": "sd', "as JSON: Unterminated string"),
        ("a.json", "[1]", "holds [1]; a table of entries is expected"),
        ("a.json", "null", "holds nothing (null)"),
        ("a.json", "9" * 5_000, "holds an integer of 5000 digits"),
        ("a.json", "", "as JSON: Expecting value"),
        ("a.json", '{"rig": [' + "0," * 4_000_001 + "0]}", "at most 33554432 and 4000000 are expected"),
        ("a.toml", "# " + "x" * 1000 + "\n" + "a = 1\n" * 200_000, "a document has at most 1048576"),
    ],
    ids=lambda x: str(x)[:30],
)  # fmt: skip
def test_what_no_document_may_hold_is_refused_before_its_schema(name, text, words, tmp_path):
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(FileFormatError) as caught:
        RigDocument.read(file)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)


def test_only_regular_files_of_a_sane_size_are_read(tmp_path):
    with pytest.raises(FileFormatError, match="folder"):
        load_document(tmp_path)
    with pytest.raises(FileFormatError, match="No such file"):
        load_document(tmp_path / "none.json")
    with pytest.raises(FileFormatError, match="cannot read"):
        load_document("a\0b.json")
    os.mkfifo(tmp_path / "pipe.json")
    with pytest.raises(FileFormatError, match="no regular file"):
        load_document(tmp_path / "pipe.json")
    with (tmp_path / "large.json").open("wb") as file:
        file.truncate(10**10)
    with pytest.raises(FileFormatError, match="10000000000 bytes"):
        load_document(tmp_path / "large.json")
    (tmp_path / "mark.json").write_bytes(b"\xef\xbb\xbf" + json.dumps(RIG).encode())
    assert load_document(tmp_path / "mark.json") == RIG
    (tmp_path / "latin.json").write_bytes(b'{"rig": "\xe9"}')
    with pytest.raises(FileFormatError, match="byte 9 is no UTF-8 text"):
        load_document(tmp_path / "latin.json")
    with pytest.raises(FileFormatError, match="at most 10"):
        load_document(tmp_path / "mark.json", limits=DocumentLimits(json_bytes=10))


def test_errors_are_of_the_kinds_that_programs_catch():
    for data, kind in (
        ({"rig": 3}, DocumentError),
        ({"rgi": "sdof"}, UnknownEntryError),
        ({"rig": "sdfo"}, UnknownNameError),
    ):
        with pytest.raises(kind) as caught:
            checked(RigDocument, data)
        assert isinstance(caught.value, ValueError)
        assert isinstance(caught.value, BenchError)


def test_sound_documents_are_taken_as_they_are(tmp_path):
    for name, document in SOUND.items():
        (tmp_path / f"{name}.json").write_text(json.dumps(document | {"$schema": "../schemas/x.json"}))
        MODELS[name].read(tmp_path / f"{name}.json")
    rig = checked(RigDocument, RIG)
    assert rig.timestep == RIG["timestep"]
    assert rig.elements[1].element().law.header == (4.0,)
    nominal = checked(NominalDocument, NOMINAL)
    assert nominal.role_of("force") == "measured"
    assert nominal.channels["displacement"].filter().order == 4  # type: ignore[union-attr]
    assert nominal.options["starts_in_motion"] == ("validation",)
    # values that programs compute, and whole numbers as editors of JSON may write them
    assert checked(RigDocument, {"rig": "sdof", "timestep": np.float64(1e-3), "seed": 3.0}).seed == 3


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=200),
        lambda x: st.lists(x, max_size=8) | st.dictionaries(st.text(max_size=30), x, max_size=8),
        max_leaves=30,
    )
)
def test_any_value_is_shown_in_one_short_line(value):
    told = shortened(value)
    assert (
        len(told) <= 80 * 6
    )  # an escaped character has at most ten places, and no text is shown beyond sixty
    assert "\n" not in told


def test_a_value_beyond_measure_is_shown_without_being_written_out():
    deep: list = []
    for _ in range(100_000):
        deep = [deep]
    assert shortened(deep) == "[[…]]"
    assert shortened(10**5_000) == "an integer of some 5001 digits"
    assert len(shortened("a" * 10**6)) < 80
    assert shortened({"a": [1, 2], "b": None, "c": True}) == "{'a': […], 'b': null, 'c': true}"


# schemas --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", KINDS)
def test_the_schemas_that_are_shipped_are_those_of_the_models(name):
    schema = generated(name)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert (FOLDER / f"{name}.json").read_text(encoding="utf-8") == text_of(schema), (
        "run scripts/make_schemas.py"
    )


def documents() -> list[tuple[str, dict]]:
    """Documents of the repository and of the fuzzer, with the kind that each is of."""
    found: list[tuple[str, dict]] = [
        ("rig", RIG), ("plan", PLAN), ("nominal", NOMINAL), ("answer", ANSWER),
        ("excitation", RIG | {"experiment": EXPERIMENT}),
        ("nominal", json.loads((ROOT / "examples/mismatch/nominal.json").read_text())),
    ]  # fmt: skip
    for path in sorted((ROOT / "examples").glob("*.toml")):
        document = tomllib.loads(path.read_text())
        found.append(("plan" if "records" in document else "excitation", document))
    return found


def test_an_editor_finds_no_fault_in_sound_documents_and_some_in_others():
    for name, document in documents():
        jsonschema.validate(document, json.loads((FOLDER / f"{name}.json").read_text()))
    schema = json.loads((FOLDER / "rig.json").read_text())
    for fault in (
        {"timestep": "1"},
        {"timstep": 1.0},
        {"elements": [{"law": "gpa", "joints": ["carriage"]}]},
        {"integrator": "rk4"},
    ):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(RIG | fault, schema)


@pytest.mark.parametrize("name", ["rig", "plan", "nominal"])
def test_whatever_a_model_takes_its_schema_takes(name, tmp_path):
    validator = jsonschema.Draft202012Validator(json.loads((FOLDER / f"{name}.json").read_text()))
    taken = 0
    for seed in range(150):
        (tmp_path / "a.json").write_text(
            mutated(SOUND[name], np.random.default_rng(seed)), errors="surrogatepass"
        )
        try:
            MODELS[name].read(tmp_path / "a.json")
        except BenchError:
            continue
        taken += 1
        assert not list(validator.iter_errors(json.loads((tmp_path / "a.json").read_text())))
    assert taken > 5


def test_a_verdict_fits_its_schema_and_is_scored():
    gap = Gap("NRMSE", 0.5, 0.4, 0.02, 0.01, math.nan, (-math.inf, 1.0), (("gap", 0.02),))
    verdict = Verdict(
        "effect",
        (NamedEffect("gap", "", 0.99, {"clearance": Estimate(1e-3, math.inf, "m")}, law="gap", theta=(1.0, 2.0)),),
        (Ranked("gap", "", 0.99),), (("gap", "gap + cubic_stiffness"),),
        (Location("x", "x", 1.0, (1.0, 2.0), (0.0, 1.0), {"displacement": (0.1, math.inf)}, regions=({"displacement": (0.1, math.inf)},)),),
        gap, (gap,), {"effect": 0.99, "none": 0.0, "unknown": 0.01}, "gap", ("a note",), next_excitation={"power": math.nan},
        splits=(Split("band_hz", "x", "", (0.0, 1.0), (1.0,), (0.5,), (True,)),),
    )  # fmt: skip
    document = json.loads(json.dumps(verdict.to_json()))
    checked(VerdictDocument, document)
    checked(ResultDocument, document)
    jsonschema.validate(document, json.loads((FOLDER / "verdict.json").read_text()))
    checked(ResultDocument, RESULT)
    checked(AnswerDocument, ANSWER | {"salt": "aa", "made_by": "another maker"})
    for fault, words in (
        ({"namd": []}, "Did you mean 'named'"),
        ({"verdict": "efect"}, "Did you mean 'effect'"),
        ({"probabilities": {"effect": None}}, "probabilities.effect: null came"),
        ({"gaps": ["a"]}, "gaps\\[0\\]: 'a' came; a gap is a table"),
    ):
        with pytest.raises(DocumentError, match=words):
            checked(ResultDocument, RESULT | fault)


def test_the_command_lists_and_writes_schemas(tmp_path, capsys):
    assert main(["schema", "--list", "--json"]) == 0
    assert {row["name"] for row in json.loads(capsys.readouterr().out)} == set(KINDS)
    assert main(["schema", "--list"]) == 0
    assert "nominal.json" in capsys.readouterr().out
    assert main(["schema", "rig"]) == 0
    assert json.loads(capsys.readouterr().out) == generated("rig")
    out = tmp_path / "plan.schema.json"
    assert main(["schema", "plan", "-o", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"name": "plan", "file": str(out)}
    assert json.loads(out.read_text()) == generated("plan")
    capsys.readouterr()
    assert main(["schema", "rig", "-o", str(out)]) == 2
    assert "--force" in capsys.readouterr().err
    assert json.loads(out.read_text()) == generated("plan")
    assert main(["schema", "rig", "-o", str(out), "--force"]) == 0
    assert json.loads(out.read_text()) == generated("rig")
    assert main(["schema", "rigg"]) == 2
    assert "Did you mean 'rig'" in capsys.readouterr().err
    assert main(["schema"]) == 2
    assert "--list" in capsys.readouterr().err


@pytest.mark.slow
def test_nothing_of_this_is_loaded_before_a_document_is_read():
    code = "import bench, bench.rig, bench.signals, bench.campaign, sys; print('pydantic' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
def test_whatever_is_done_to_a_document_ends_in_an_error_of_the_bench(target, tmp_path):
    assert run(target, 50, seed=20) == []


def test_an_array_by_an_alias_of_the_type_statement_is_a_list_of_numbers():
    item = TypeVar("item", bound=np.generic)
    alias = TypeAliasType("alias", np.ndarray[tuple[Any, ...], np.dtype[item]], type_params=(item,))
    assert kind_of(alias[np.float64], lambda hint: None) == Listed[Number]
