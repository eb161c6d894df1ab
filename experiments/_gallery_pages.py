"""Texts of the gallery and the first page: one entry an experiment.

A new experiment gets an entry here; ``gallery.py --readme`` then renews the table of README.md.
"""

from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
#: Scripts that are no experiment of their own, and why.
TOOLS = {
    "bench": "measures speed, `make bench`",
    "gallery": "builds the page",
    "make_meshes": "makes the meshes, `make mesh`",
}
SMALL_PICTURES = "docs/pictures"


@dataclass(frozen=True)
class Page:
    """Description of one experiment.

    name: of the script. part: heading under which it stands. question: that it answers. look:
    what to read off its pictures. time: of the full run on two cores, in words. pictures: names
    of its pictures and films, the most telling first; what else it writes is linked. figures:
    patterns of the key figures in summary.json; figures with a paper's value are always shown.
    paper: what the paper says of it, empty where it does not ask this. options: of the command.
    """

    name: str
    part: str
    question: str
    look: str
    time: str
    pictures: tuple
    figures: tuple = ()
    paper: str = ""
    options: str = ""

    @property
    def command(self):
        """Command line of a user."""
        return " ".join(filter(None, [f"python experiments/{self.name}.py", self.options]))


START, BLAST, DAMPER, PRICE = (
    "First demonstrations",
    "The blast",
    "The granular damper",
    "What accuracy costs, what stays stable, what effects cost",
)

PAGES = (
    Page(
        "demo_fracture_law",
        START,
        "Does a bond do what its law says, when it is pulled, unloaded, reloaded and sheared?",
        "Measured points lie on the drawn law: up to the peak, down the softening branch to zero, "
        "back to the origin when unloaded. In shear, four pressures give four plateaus.",
        "15 s",
        ("law.png", "law.gif"),
        ("plateau_at_*_MPa",),
        "Figs 1 to 4 and Table 1 of the blast's paper: 6.66 MPa, 99.67 N/m.",
    ),
    Page(
        "demo_wave_and_spall",
        START,
        "Where does a bar break when a pulse comes back from its free end?",
        "The free end moves twice as fast as the wave behind it. The stronger the pulse, the "
        "thinner the piece that flies off, within one cell of the formula.",
        "15 s",
        ("spall.png", "spall.gif", "wave.png"),
        ("wave_speed*", "free_end*", "spall_*_depth_m", "spall_*_formula_m"),
    ),
    Page(
        "demo_multirate",
        START,
        "Do steps that differ by body change what one sees of a blow?",
        "Colours are levels: short steps follow the wave into the bar. Both curves of the "
        "displacement lie on each other; only the number of evaluations differs.",
        "35 s",
        ("blow.png", "blow.gif"),
        ("*evaluations", "*difference"),
        "Section 3.1 and Fig. 6 of the blast's paper: steps by halves, impulses shared.",
    ),
    Page(
        "demo_step_too_large",
        START,
        "What goes wrong when the step is too large, and what does the program say?",
        "Below the limit the energy account closes whatever the step. Above it the motion grows by "
        "the same factor every step, until the program ends the run and says where and why.",
        "25 s",
        ("energy.png", "shaken.gif"),
        ("limit_*", "*_diverged"),
    ),
    Page(
        "demo_damper",
        START,
        "What does a handful of grains in a box do to its vibration?",
        "Two boxes begin alike, one with grains and one empty. The grains are thrown, land and "
        "take motion with them: the full box ends with the smaller swing.",
        "10 s",
        ("damper.gif", "motion.png"),
        ("amplitude*", "damping*", "apparent*", "loss*"),
        options="--particles 30",
    ),
    Page(
        "blast_fracture",
        BLAST,
        "How does a block break when a hole in it is blasted?",
        "A crushed zone at the hole, cracks that run out from it, and a wedge pushed out of the "
        "free face on the right. Colours are times of breaking.",
        "20 s",
        ("cracks.png", "blast.gif", "energy.png", "steps.png"),
        ("hole_radial*", "monitor*", "broken_faces", "ledger*", "seconds*"),
        "Figs 11 to 13: the same zone, cracks and wedge, at 1 ms. Its 1.93 mm belong to an element "
        "near the hole that it does not name; the body we watch sits on the wall of the hole. Its "
        "smallest step and its minutes are those of another method (see blast_methods).",
    ),
    Page(
        "blast_methods",
        BLAST,
        "Which method solves that, how fast, and how well?",
        "All curves lie on each other until a bond on the edge of breaking parts them. Solving the "
        "dashpots takes about a second where the paper's rule takes minutes.",
        "about 10 min",
        ("methods.png",),
        ("seconds_*", "displacement_error_*", "largest_stable_step_s_*"),
        "Section 4.3: 3897 min with one step for all, 2702 min with a step for each.",
    ),
    Page(
        "blast_sweeps",
        BLAST,
        "Which way of sweeping solves the dashpots of all bonds in the fewest sweeps?",
        "Lower is better. Bond after bond by colours needs two or three sweeps to a thousandth, "
        "all bonds at once five to seven: this is why the solver goes by colours.",
        "20 s",
        ("sweeps.png",),
        ("sweeps_*",),
    ),
    Page(
        "blast_multirate",
        BLAST,
        "What do steps that differ by body save, and what do they change?",
        "Little at 0.05 ms, when few bodies move; a lot at 0.5 ms. With neighbours held the "
        "displacement differs by 0.2 %; with drifted ones a bond on the edge of breaking at 0.2 ms "
        "goes the other way, and 1 to 4 % with it.",
        "about 6 min",
        ("methods.png",),
        ("*_gain", "*displacement_difference"),
        "Section 4.3: 16 and 14 min at 0.05 ms, 3897 and 2702 min at 0.5 ms (1.44 times), 2.16 and "
        "1.93 mm.",
    ),
    Page(
        "blast_scaling",
        BLAST,
        "What does it take to keep many workers busy while the work moves over the block?",
        "Fixed shares end far apart, shares cut anew after every 50 steps together. Yet workers "
        "with runs of bodies wait at ticks to which few bodies come; equal parts of what is due, "
        "as the lists of this program give them, stay near the dotted bound.",
        "about 8 min",
        ("scaling.png",),
        ("imbalance*", "speedup*", "contact*"),
        "Figs 8, 9, 14 and 15: slowest over fastest of 24 processes 5.8 without rebalancing and "
        "1.1 with it; 501 minutes instead of 541, 2702 with one.",
    ),
    Page(
        "blast_block",
        BLAST,
        "How does the full block break, 3 m deep, which the paper could not afford?",
        "Cracks in space and in two sections, by time of breaking: half-way along the hole they "
        "are those of the flat block. Peak velocities fall as a power of the distance.",
        "2 min on one",
        ("cracks.png", "peaks.png", "energy.png"),
        ("broken*", "ppv*", "seconds*", "memory*"),
        "Section 4.1: the full block would take its rule more than a month.",
    ),
    Page(
        "damper_rebound",
        DAMPER,
        "Does a particle of the automaton fall and rebound as it should?",
        "The paths follow the closed form to the fourth impact. Two readings of the rules drift "
        "off by tens of milliseconds: they are shown, not hidden.",
        "10 s",
        ("rebound.png",),
        ("*impact*",),
        "Fig. 8 of the damper's paper: four rebounds that agree by eye, e = 0.75.",
    ),
    Page(
        "damper_patterns",
        DAMPER,
        "How do grains move in a shaken container, by automaton and by spheres?",
        "One cycle in eight pictures. The floor throws the grains up, they come apart in the air "
        "and are caught again; the automaton's swing further, and earlier.",
        "20 s",
        ("patterns_20.png", "patterns.gif", "patterns_40.png", "cycle.png"),
        ("height_amplitude*", "height_lag*"),
        "Figs 9 and 10: the same eight instants, computed and photographed, compared by eye.",
    ),
    Page(
        "damper_response",
        DAMPER,
        "How do 10 to 50 grains damp a structure over frequency, and which accounting of contact "
        "forces gets the peak right?",
        "More grains, lower peak. With static contact the automaton's peak moves to lower "
        "frequency as the spheres' does; counting blows alone leaves it where it is.",
        "about 7 min",
        ("response.png", "measures.png", "hysteresis.png"),
        ("peak_ratio_*_N10", "peak_ratio_*_N30", "peak_ratio_*_N50", "peak_rms_mm_*_N30"),
        "Figs 2, 3 and 11: damping grows with the number; measured and computed by spheres the "
        "peak moves down, by the automaton up, which the paper puts down to static contact.",
    ),
    Page(
        "damper_cost",
        DAMPER,
        "What does a cycle cost against the number of grains, and which steps are stable?",
        "Spheres by all pairs grow ever more steeply, by cells about with the number; the "
        "automaton by a list of particles is cheapest at any number. Spheres diverge from 50 µs "
        "on, the automaton bears every step in which no particle crosses a cell.",
        "1 min",
        ("cost.png", "steps.png"),
        ("cycle_ms_*", "growth_*", "longest_step_*"),
        "Fig. 12: spheres grow steeply, the automaton stays flat.",
    ),
    Page(
        "cost_of_accuracy_blast",
        PRICE,
        "What does an error of 1 % in the blast cost, by method?",
        "Left is cheap, low is exact. A method that lies left of another at the same height gives "
        "the same answer for less; crosses are runs that failed.",
        "9 min on one",
        ("work_precision.png", "errors.png"),
        ("cheapest*", "seconds_at*", "paper_rule*", "chaos_floor"),
    ),
    Page(
        "cost_of_accuracy_damper",
        PRICE,
        "What does an error of 10 or 1 % in the damper's response cost, by automaton, spheres and "
        "RK45?",
        "Left is cheap, low is exact, crosses failed or were refused. Each method is compared with "
        "its own limit; dotted is what other seeds alone make of that, below which a shorter step "
        "buys nothing.",
        "5 min on one",
        ("work_precision.png", "against_spheres.png", "curves.png", "rk45.png"),
        ("cheapest*", "seconds_at*", "chaos_floor"),
    ),
    Page(
        "hard_cases",
        PRICE,
        "Which scenes at the edge does each method bear, by what margin, and which does it refuse?",
        "A row a case, a mark a method: right of the line it stays within what physics allows, "
        "left it refuses in words; one that returns numbers where it should refuse has failed. The "
        "sheets show what each case did.",
        "10 min on one",
        ("hard_cases.png", "hard_cases_blast.png", "hard_cases_damper.png"),
        ("*",),
    ),
    Page(
        "cost_of_effects",
        PRICE,
        "What does each effect cost, and what does the result lose without it?",
        "Long bars are dear effects. One that costs time and changes nothing here can be left out "
        "of a scene like this; one that is left out costs nothing, to within the noise.",
        "5 min",
        ("effects.png",),
        ("overhead_absent*", "*_seconds", "*_change*"),
    ),
)


def pages():
    """The entries whose script is there, in order."""
    return tuple(page for page in PAGES if (HERE / f"{page.name}.py").is_file())


def readme_table():
    """The table of all experiments for README.md, with a small picture where there is one."""
    lines = ["| question | command | time on two cores | picture |", "|---|---|---|---|"]
    for page in pages():
        small = f"{SMALL_PICTURES}/{page.name}.png"
        there = (HERE.parent / small).is_file()
        link = f"[picture]({small})" if there else ""
        lines.append(f"| {page.question} | `{page.command}` | {page.time} | {link} |")
    return "\n".join(lines) + "\n"
