"""How does a block of concrete break when a hole in it is blasted?

The main job: the scene of Konno et al., section 4, from mesh to crack picture. Expect a crushed
zone at the hole, cracks that run out from it, and a wedge pushed out of the free face on the right.

    python experiments/blast_fracture.py
    python experiments/blast_fracture.py --all-pictures   # also energy, pressure, where effects act
    python experiments/blast_fracture.py --until 1e-3     # cracks through to the other faces
    python experiments/blast_fracture.py --method multirate --l 1e-8    # the paper's: three minutes
    python experiments/blast_fracture.py --accuracy 1%         # hole's displacement, with a bar
    python experiments/blast_fracture.py --accuracy 5% --budget contact    # contact's part, too
    python experiments/blast_fracture.py --effects all         # laws evaluated everywhere
    python experiments/blast_fracture.py --with sphere_contact,friction    # contact of the paper

Bodies touch as wholes and stick until they slip, as in any scene with effects="auto"; the paper has
spheres behind broken faces, and sliding friction (demo_contact.py compares both). An effect of
--with takes the place of the usual one of its kind: surface_contact has spheres on all free faces.

Softening, slip and contact are evaluated only where and when they act; bodies that no wave has
reached sleep. The certificate in the report says what acted, since when, and what was left out.

A run saves itself in run.checkpoint at its end, on Ctrl-C, and as often as --checkpoint-every says.
The same command with --resume continues it, also with a larger --until.

With --accuracy, the program finds the displacement of the hole to this share of its value; for a
mesh without a hole, the kinetic energy. It chooses method and step, whatever --method, --samples
and --frames say. It prints the answer with its error bar and cost, and the cost of other
accuracies. It names each source of error, measured or not; --budget contact also measures the
contact law against a finer one. The cracks are those of its finest run; nothing else is run or
drawn.

Dashpots are solved together unless another method is asked for; blast_methods.py compares them.

``python -m taichi_dem demo`` is the same job without these choices, for an installed package.

Writes cracks.png, blast.gif, view.html (a page in which the block turns and plays), history.csv,
bonds.csv (when each bond broke), bodies.csv, the mesh used, summary.json and a ParaView series
(paraview/blast_fracture.pvd) to results/blast_fracture/.
"""

import sys
from functools import partial

import taichi_dem as dem
from cases.blast import EFFECTS, blast_parser, run_options
from cases.blast import METHODS as BLAST_METHODS
from taichi_dem.demo import SETTINGS as DEMO_SETTINGS
from taichi_dem.demo import figures_of, picture
from taichi_dem.kit import study
from taichi_dem.laws.roles import WORDS
from taichi_dem.methods import Multirate, Uniform

NAME = "blast_fracture"
#: Methods of the paper, made of the largest step dt0 [s] and the displacement limit l [m].
PAPER_METHODS = {
    "multirate": Multirate,
    "multirate_drifted": partial(Multirate, neighbour="drifted"),
    "uniform": Uniform,
}
#: The others by name: how they are made of their largest step, and that step [s].
METHODS = {
    "implicit": BLAST_METHODS["implicit"],
    "limited": BLAST_METHODS["explicit_limited"],
    "controlled": BLAST_METHODS["multirate_controlled"],
    "fixed": (Uniform, 1e-8),
}
PAPER_DT0, PAPER_L = 1e-8, 1e-7
SETTINGS = {
    "dt0": (None, None, study.number(0, 1), "largest step [s]; default: that of the method"),
    "l": (None, None, study.number(0, 1), "limit of a displacement in a step [m], default 1e-7"),
    "without": ("", "", str, "effects to leave out, with commas"),
    **DEMO_SETTINGS,
}


def options_parser():
    """Options of this experiment."""
    made = blast_parser(NAME, __doc__, settings=SETTINGS, saves=True)
    made.add_argument("--method", choices=(*METHODS, *PAPER_METHODS), default="implicit")
    made.add_argument("--with", dest="added", default="", help="effects to add, with commas")
    words = "auto (default): evaluate laws only where they act; all: everywhere"
    made.add_argument("--effects", choices=WORDS, default=WORDS[0], help=words)
    study.add_accuracy(made, "the displacement of the hole", "contact")
    study.add_pictures(made)
    return made


def effects_named(text, known):
    """Names of effects in a text, by comma; known: those that there are."""
    names = [name for name in text.split(",") if name]
    for name in names:
        if name not in known:
            raise dem.InputError(f"effect must be one of {', '.join(known)}, got {name!r}")
    return names


def chosen_scene(options):
    """The block under gas, with the usual effects but for those that options add and leave out."""
    mesh = dem.read_mesh(options.mesh)
    names = ["gas_pressure", *effects_named(options.added, EFFECTS)]
    given = [make() for name, make in EFFECTS.items() if name in names]
    scene = dem.Scene(mesh, dem.CONCRETE, options.effects, loads=given)
    without = effects_named(options.without, [effect.name for effect in scene.effects])
    if without:
        listed = [effect for effect in scene.effects if effect.name not in without]
        scene = dem.Scene(mesh, dem.CONCRETE, listed)
    return scene


def chosen_method(name, dt0, distance):
    """Method of a name with its own step and way, or those asked for."""
    if name in PAPER_METHODS:
        return PAPER_METHODS[name](dt0 or PAPER_DT0, distance or PAPER_L)
    if distance is not None:
        paper = ", ".join(PAPER_METHODS)
        words = f"must be left out unless method is one of {paper}, got {distance:g}"
        raise dem.InputError(f"l {words}")
    make, step = METHODS[name]
    return make(dt0 or step)


def run(options):
    """Run, picture, print."""
    method = chosen_method(options.method, options.dt0, options.l)
    scene = chosen_scene(options)
    if options.accuracy is not None:
        return run_to_accuracy(scene, options)
    if options.verbose:
        print(dem.step_report(scene))
        print("", *dem.estimated_effects(scene, options.until), "", sep="\n")
    try:
        result = dem.simulate(scene, method=method, title="blasting", **run_options(options))
    except dem.SimulationDiverged as error:
        if error.result.frames:
            picture(error.result, options)
        raise
    study.show_report(options, result.report)
    draw = partial(picture, result, options)
    study.finish(options, NAME, figures_of(result), [result.report], see="cracks.png", draw=draw)


def run_to_accuracy(scene, options):
    """Find the first goal that the scene has to an accuracy; print and write the answer."""
    study.check_accuracy(options, ("dt0", "l"))
    at = study.output_paths(options.out)
    in_a_hole = "hole" in scene.mesh.groups
    goal = dem.goals.hole_displacement() if in_a_hole else dem.goals.kinetic_energy()
    asked = {"tolerance": options.accuracy, "sources": study.accuracy_sources(options)}
    answer = dem.solve(scene, until=options.until, goal=goal, **asked)
    study.show_answer(f"blast, {options.until:g} s", answer)
    study.write_accuracy(options.out, (), [((), answer)])

    def draw():
        if options.pictures != "no":
            answer.result.plot.cracks(magnify=3.0, path=at("cracks.png"))

    study.finish(options, NAME, figures_of_answer(answer), 0.0, see="cracks.png", draw=draw)


def figures_of_answer(answer):
    """Value, half-width of its bar, and CPU seconds."""
    name, unit = answer.goal.replace(" ", "_"), answer.unit
    return {
        f"{name}_{unit}": (answer.value, unit),
        f"{name}_error_{unit}": (answer.error, unit),
        "accuracy_reached": (int(answer.reached), "1"),
        "cpu_seconds": (answer.plan.seconds, "s"),
        "pilot_cpu_seconds": (answer.plan.pilot_s, "s"),
    }


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
