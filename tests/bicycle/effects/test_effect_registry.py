"""Effects from files and packages: how they become known, in which processes, and what is refused."""

import os
import pickle
import re
import subprocess
import sys

import pytest

from bicycle import Effect, Mode, Model, Parameter, effect_class, load_bicycle, load_effects, registry
from bicycle.effects import model_workers, outside_effects, packaged_effects, register
from tyre.ground import InputError

SPRING = '''
from bicycle import Effect, Parameter

class Spring(Effect):
    """A spring on the steering."""

    stiffness = Parameter("N m/rad", "of the spring", bounds=(0.0, 1e9), typical=(0.0, 10.0), default=3.0, neutral=0.0)
    source = "none"
    signature = "as steer_spring"

    def apply(self, model):
        model.add_torque(model.steer, -self.stiffness * model.steer.angle)
'''


@pytest.fixture
def spring(tmp_path):
    path = tmp_path / "my_spring.py"
    path.write_text(SPRING)
    with outside_effects(()):  # forgets what the test loads
        yield path


def test_a_file_is_an_effect_by_its_name(spring):
    (kind,) = load_effects(spring)
    assert effect_class("my_spring") is kind is registry()["my_spring"]
    bicycle = load_bicycle("benchmark")
    own = Model(bicycle, kind(stiffness=4.0)).linear_model().eigenvalues(5.0)
    assert (own == Model(bicycle, effect_class("steer_spring")(stiffness=4.0)).linear_model().eigenvalues(5.0)).all()
    assert load_effects(spring) == (kind,)  # the same file, the same class
    assert pickle.loads(pickle.dumps(kind(stiffness=4.0))) == kind(stiffness=4.0)


def test_a_changed_file_takes_the_place_of_the_former(spring):
    load_effects(spring)
    spring.write_text(SPRING.replace("default=3.0", "default=5.0"))
    (kind,) = load_effects(spring)
    assert effect_class("my_spring") is kind
    assert kind().values({}) == {"my_spring.stiffness": 5.0}


def test_effects_of_a_block_are_forgotten(spring):
    with outside_effects([spring]):
        assert "my_spring" in registry()
    assert "my_spring" not in registry()
    assert set(packaged_effects()) <= set(registry())


def test_a_class_of_a_session_cannot_go_to_workers(spring):
    @register
    class Here(Effect):
        """A toy."""

        identifier, source, signature = "here", "none", "nothing"

        def apply(self, model):
            pass

    with pytest.raises(InputError, match="Here of .* cannot be imported by a worker process; put it into a file"):
        model_workers(1).__enter__()
    assert registry()["here"] is Here


@pytest.mark.parametrize(("name", "text", "words"), [
    ("toy.toml", "", "toy.toml: give a Python file with effects, whose name ends in .py"),
    ("toy.py", None, "toy.py: cannot be read .*give a Python file with an Effect"),
    ("toy.py", "class Toy(Effect:\n", "toy.py, line 1: this is not Python .*correct the line"),
    ("toy.py", "x = 1\ny = x / 0\n", "toy.py, line 2: the file cannot be run: ZeroDivisionError: division by zero"),
    ("toy.py", "raise SystemExit(3)\n", "toy.py, line 1: the file cannot be run: SystemExit: 3; correct it"),
    ("toy.py", "x = 1\n", "toy.py: defines no effect; write a class that inherits from bicycle.Effect"),
    ("steer_spring.py", SPRING, "steer_spring.py: the effect 'steer_spring' exists already .bicycle.effects.steer"),
    ("my-toy.py", SPRING, "effect 'my-toy': its identifier has other than small letters, digits and underscores"),
    ("toy.py", SPRING.replace("def apply", "def aply"), "effect 'toy': it has no method apply.self, model."),
    ("toy.py", SPRING.replace('source = "none"', ""), "effect 'toy': it lacks source .where its equation is from."),
    ("toy.py", SPRING.replace("(0.0, 10.0)", "(0.0, 1e10)"), "stiffness: typical 0 .. 1e.10 is not within the bou"),
    ("toy.py", SPRING.replace("(0.0, 1e9)", "5.0"), "stiffness: bounds = 5.0 must be two numbers .low, high."),
    ("toy.py", SPRING.replace("default=3.0", "default='lam_'"), "default = 'lam_' must be a number or a parameter"),
    ("toy.py", SPRING.replace("default=3.0", "default=-3.0"), "default = -3.0 is outside the bounds 0 .. 1e.09"),
    ("toy.py", SPRING.replace("=0.0)", "=0.0, least=-1)"), "least = -1 must be a size in N m/rad, 0 or more"),
    ("toy.py", SPRING.replace("=0.0)", "=0.0, least=10)"), "least = 10 N m/rad is as large as anything typical"),
    ("toy.py", SPRING.replace("neutral=0.0)", "neutral=math.inf, least=1)").replace("1e9", "math.inf")
     .replace("(0.0, 10.0)", "(1.0, 10.0)").replace("from b", "import math\nfrom b"),
     "least = 1 N m/rad is the stiffness above which it does not matter, so it must be above the softest typical"),
    ("toy.py", SPRING.replace('"N m/rad"', '""'), "stiffness has no unit or no meaning"),
    ("toy.py", SPRING.replace('"of the spring"', '""'), "stiffness has no unit or no meaning"),
    ("toy.py", SPRING.replace('"N m/rad"', '"furlong"'), "stiffness: unit = 'furlong' is not one of kg, m, s, rad"),
    ("toy.py", SPRING.replace('"N m/rad"', '"N m/deg"'), "stiffness: unit = 'N m/deg' is not one of kg, m, s, ra"),
    ("toy.py", SPRING + "    requires = ('a tyer',)\n", "it requires 'a tyer', which no effect provides; there"),
    ("toy.py", SPRING + "    modes = ('sway',)\n", "modes holds 'sway'; write modes = .Mode.'a_name'"),
    ("toy.py", SPRING + "    parameters = ()\n", "toy.py: .*declare each parameter as an attribute of the class"),
])  # fmt: skip
def test_refused_files(tmp_path, name, text, words):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words), outside_effects([tmp_path / name]):
        pass
    assert set(registry()) == set(packaged_effects())


@pytest.mark.parametrize(("right", "wrong", "words"), [
    ("steer.angle", "steer.angel", "AttributeError: 'Coordinate' object has no attribute 'angel'"),
    ("-self.stiffness", "-self.stifness", "AttributeError: .* has no attribute 'stifness'"),
    ("model.steer, -self", "-self", "TypeError: .* missing 1 required positional argument: 'torque'"),
    ("-self.stiffness", "-math.sin(self.stiffness)", "TypeError: Cannot convert expression to float"),
])  # fmt: skip
def test_a_mistake_in_apply_is_one_line_with_file_and_line(tmp_path, right, wrong, words):
    text = "import math\n" + SPRING
    assert text.count(right) == 1
    (tmp_path / "toy.py").write_text(text.replace(right, wrong))
    at = 1 + text[: text.index(right)].count("\n")
    said = f"toy.py, line {at}: effect 'toy' cannot be added to the equations: {words}.*; correct its apply"
    with outside_effects([tmp_path / "toy.py"]), pytest.raises(InputError, match=said):
        Model(load_bicycle("benchmark"), effect_class("toy")()).linear_model()


@pytest.mark.parametrize(("mode", "words"), [
    (Mode("weave"), "a mode is called 'weave': the names weave, wobble, capsize, castering and other_1"),
    (Mode("rider", place=1), "the mode 'rider' is declared differently by another effect"),
    (Mode("sway", look=1), "look = 1 is that of front_compliance; leave it out"),
])  # fmt: skip
def test_refused_modes(mode, words):
    class Toy(Effect):
        """A toy."""

        identifier, source, signature, modes = "toy", "none", "nothing", (mode,)

        def apply(self, model):
            pass

    with pytest.raises(InputError, match=words):
        register(Toy)


class Sway(Effect):
    """A toy with a mode, which a test marks or not."""

    identifier = "sway"
    modes = (Mode("sway"),)
    size = Parameter("1", "of the toy", bounds=(0.0, 1.0), typical=(0.1, 0.2), default=0.1)


@pytest.mark.parametrize(("apply", "words"), [
    (lambda self, model: None, "the mode 'sway' is marked by states of the role 'sway', and there are none"),
    (lambda self, model: model.add_state("sway", unit="N", role="sway"), "the state 'sway' has no rate of change"),
    (lambda self, model: model.add_state("lean", unit="rad"), "two states are called 'lean'"),
    (
        lambda self, model: model.add_joint("sway", axis=(1, 0), point=(0, 0), carries={"rear wheeel"}),
        "joint 'sway' carries unknown body 'rear wheeel'; did you mean 'rear wheel'",
    ),
    (lambda self, model: model.add_body(model.bodies[0]), "two bodies are called 'rear frame'"),
])  # fmt: skip
def test_what_the_builder_refuses(apply, words):
    kind = type("Sway", (Sway,), {"identifier": "sway", "apply": apply})
    with pytest.raises(InputError, match=words):
        Model(load_bicycle("benchmark"), kind()).linear_model()


ASK = """
import sys
from bicycle.effects import registry

for folder in sys.argv[1:]:
    sys.path.insert(0, folder)
    try:
        print(registry()["packed"])
    except Exception as error:
        print(error)
    sys.path.remove(folder)
"""
REFUSED = [
    ("packed = absent", "the installed package toys .*cannot be imported: ModuleNotFoundError"),
    ("packed = os.path", "is neither an Effect nor a module with effects; correct or uninstall it"),
]


@pytest.mark.parametrize("cases", [
    [*REFUSED, ("packed = packed", "<class 'packed.Spring'>")], [("packed = packed:Spring", "<class 'packed.Spring'>")],
])  # fmt: skip
def test_installed_packages_offer_effects(tmp_path, cases):
    """What is found is found once a process; a refusal is not kept."""
    folders = [tmp_path / str(k) for k in range(len(cases))]
    for folder, (entry, _) in zip(folders, cases, strict=True):
        info = folder / "toys-1.0.dist-info"
        info.mkdir(parents=True)
        (folder / "packed.py").write_text(SPRING)
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toys\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[velotyre.effects]\n{entry}\n")
    paths = os.pathsep.join(filter(None, sys.path))
    shown = subprocess.run(
        [sys.executable, "-c", ASK, *folders], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": paths}
    )
    answers = shown.stdout.splitlines()
    for answer, (_, words) in zip(answers, cases, strict=True):
        assert re.search(words, answer)
