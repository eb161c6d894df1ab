"""Tables and figures of ``cost_of_effects.py``."""

import numpy as np

from ca_damper.report.measures import curve_distance
from taichi_dem.kit import study
from taichi_dem.kit.study.paired_timing import median_interval

LAST_BIT = "all effects, last bit of the load changed"
#: Contact and friction in the place of those of bodies, by row: the paper's, then on all faces.
CONTACTS = {
    "contact of spheres": ("sphere_contact", "friction"),
    "spheres on all faces": ("surface_contact", "friction"),
}
ADDED = ("rotation", *CONTACTS)
#: Columns of what an effect adds, and their units.
ADDS = {"memory_MB": "MB", "compiled_kB": "kB"}
#: Ends of names of columns by number of a cost.
ENDS = {"ratio": "", "low": "_least", "high": "_most"}
#: Numbers in a step of the blast that tell why it costs more.
COUNTS = ("sweeps", "searches", "pairs")
#: Why a step is dearer without an effect.
WHY = {
    "sticking_friction": "contacts that nothing slows down stay more, and agree later",
    "static contact": "particles that would be held have to fly and collide",
    "ejection and static contact": "particles that would be held have to fly and collide",
}
#: What is printed of a row: header, name of the column, format. Files have all columns.
SHOWN = {
    "scene": ("scene", ""),
    "step [ms]": ("step_ms", ".3g"),
    "spares [%]": ("spared_percent", ".3g"),
    "at least": ("spared_least_percent", ".3g"),
    "at most": ("spared_most_percent", ".3g"),
    "hole [mm]": ("hole_mm", ".4g"),
    "peak [mm]": ("peak_mm", ".4g"),
    "broken faces": ("broken_faces", ""),
    "change [%]": ("change_percent", ".3g"),
}

SHOWN_OF_LISTS = {
    "scene": ("scene", ""),
    "effects": ("list", ""),
    "step [ms]": ("step_ms", ".3g"),
    "beyond [%]": ("over_best_percent", ".3g"),
    "at least": ("over_best_least_percent", ".3g"),
    "at most": ("over_best_most_percent", ".3g"),
}


def row_of(group, scene, repeats, complete, known):
    """Row of a table.

    repeats: results of the scene's own runs. complete: (scene, results) of the first of the group.
    known: costs of a step by scene.
    """
    failed = repeats[0].get("failed", "")
    first, others = complete
    result = blast_result if group == "blast" else damper_result
    found = others if failed else repeats
    columns = {
        **costs(known.get(scene), known[first], found[0]["steps"]),
        **own_run(found),
        **result(scene, found[0], others[0]),
    }
    row = {"group": group, "scene": scene, "failed": failed}
    return {**row, **(dict.fromkeys(columns) if failed else columns)}


def costs(cost, complete, steps):
    """Cost of a step, and what it spares of one of the complete scene, from the same states."""
    counts = [name for name in COUNTS if name in complete]
    names = ("step_ms", "spared_percent", "spared_least_percent", "spared_most_percent", "spared_s")
    if cost is None:
        return dict.fromkeys((*names, "rounds", *counts))
    # By ratio and not by seconds, which differ from round to round with the load of the machine.
    shares = [1.0 - cost[end] for end in ("ratio", "high", "low")]
    step = 1e3 * complete["seconds"] * cost["ratio"]
    values = step, *(100.0 * share for share in shares), shares[0] * complete["seconds"] * steps
    return {**dict(zip(names, values)), **{name: cost[name] for name in ("rounds", *counts)}}


def own_run(repeats):
    """What a run took in a process of its own."""
    first = repeats[0]
    times = [1e3 * found["run_s"] / found["steps"] for found in repeats]
    return {
        "run_step_ms": min(times),
        "run_step_ms_most": max(times),
        "run_s": 1e-3 * min(times) * first["steps"],
        "memory_MB": first["memory_MB"],
        "before_first_step_s": first["compile_s"],
        "compiled_kB": first["compiled_kB"],
    }


def blast_result(scene, found, complete):
    """Result of a blast; the share of energy is that of the first effect that is left out."""
    share = complete["shares"].get(scene.replace("without ", "").split()[0])
    hole, wanted = found["hole_mm"], complete["hole_mm"]
    return {
        "hole_mm": hole,
        "broken_faces": found["broken_faces"],
        "energy_percent": None if share is None else 100.0 * share,
        "change_percent": 100.0 * abs(hole - wanted) / abs(wanted),
    }


def damper_result(scene, found, complete):
    """Peak of a response; the change is the distance to that of the complete filling.

    For the complete filling it is half of the distance of two seeds: what the mean over them may
    owe to chance.
    """
    curve, (one, other) = np.mean(found["rms_mm"], axis=0), complete["rms_mm"]
    change = 100.0 * curve_distance(curve, np.mean(complete["rms_mm"], axis=0))
    if found is complete:
        change = 50.0 * curve_distance(one, other)
    return {"peak_mm": float(curve.max()), "change_percent": change}


def effects_in(rows):
    """(Name, row, sign) of each effect that was left out alone, or added: then the sign is -1."""
    for row in rows[1:]:
        name = row["scene"].replace("without ", "")
        if row["group"] != "blast" or name != row["scene"] or name in ADDED:
            yield name, row, -1.0 if name in ADDED else 1.0


def cost_in(row, sign):
    """Cost of an effect and the ends of its interval [%], from its row and sign."""
    cost, *ends = (sign * row[f"spared_{end}percent"] for end in ("", "least_", "most_"))
    return cost, min(ends), max(ends)


def chance_in(rows):
    """Change of the result by chance [%]: seeds, or the last bit of the load; None if not tried."""
    scene = LAST_BIT if rows[0]["group"] == "blast" else rows[0]["scene"]
    return next((row["change_percent"] for row in rows if row["scene"] == scene), None)


def figures_of(tables, elastic):
    """Overhead of what is absent; for each effect what it adds, and what its absence changes."""
    # Each against its neighbour in time: a machine is never equally fast for long.
    ratio = np.array(elastic["composed"]) / np.array(elastic["by_hand"])
    overhead = dict(zip(("", "_low", "_high"), (np.median(ratio), *median_interval(ratio))))
    found = {
        f"overhead_absent{end}_percent": (100.0 * (value - 1.0), "%")
        for end, value in overhead.items()
    }
    found["blast_seconds"] = tables["blast"][0]["run_s"], "s"
    if chance_in(tables["blast"]) is not None:
        found["blast_chance_percent"] = chance_in(tables["blast"]), "%"
    for group, rows in tables.items():
        for name, row, sign in effects_in(rows):
            found.update(figures_of_effect(group, name, row, rows[0], sign))
    return {key: study.figure(value, unit) for key, (value, unit) in found.items()}


def figures_of_effect(group, name, row, complete, sign):
    """What an effect adds to a run and to a step, and what its absence changes."""
    own, known = group == "blast", not row["failed"]
    key = f"{group}_{name.replace(' ', '_')}"
    if own:
        key = CONTACTS.get(name, name.split())[0]
    found = {}
    for column, unit in ADDS.items():
        more = sign * (complete[column] - row[column]) if known else None
        found[f"{key}_{column}"] = more, unit
    found[f"{key}_seconds"] = (sign * row["spared_s"] if known else None), "s"
    ends = cost_in(row, sign) if known else (None, None, None)
    for end, value in zip(("", "_low", "_high"), ends):
        found[f"{key}_step{end}_percent"] = value, "%"
    what = "displacement" if own else "response"
    found[f"{key}_{what}_change_percent"] = row["change_percent"], "%"
    if own:
        more = row["broken_faces"] - complete["broken_faces"] if known else None
        found[f"{key}_broken_faces_change"] = more, "1"
    return found


def show(rows, title):
    """Print the rows, why some of them failed, and why some cost time to leave out."""
    print(f"\n{title}")
    study.show_rows(rows, {name: form for name, form in SHOWN.items() if form[0] in rows[0]})
    for row in rows:
        if row["failed"]:
            print(f"{row['scene']}: {row['failed']}")
    for name, row, sign in effects_in(rows):
        if not row["failed"] and cost_in(row, sign)[2] < 0.0:
            print(why_dearer(name, row, rows[0], sign))


def why_dearer(name, row, complete, sign):
    """Why a step takes longer without an effect (sign 1), or less time with one that was added."""
    cost, least, most = cost_in(row, sign)
    how = "without it takes more" if sign > 0.0 else "with it takes less"
    counted = [
        f"{row[name]:.3g} {name} instead of {complete[name]:.3g}"
        for name in COUNTS
        if row.get(name) is not None
    ]
    reasons = [WHY[known] for known in (name,) if known in WHY]
    reasons += [f"a step has {', '.join(counted)}"] * bool(counted)
    ends = f"{-cost:.1f} % ({-most:.1f} to {-least:.1f})"
    return ": ".join([f"{name}: a step {how}, {ends}", *["; ".join(reasons)] * bool(reasons)])


def list_rows(known):
    """Rows of the scenes whose best list of effects is known: each candidate beside that list."""
    rows = []
    for scene, costs_by_list in known.items():
        for name, cost in costs_by_list.items():
            ends = {
                f"over_best{end}_percent": 100.0 * (cost[key] - 1.0) for key, end in ENDS.items()
            }
            row = {"scene": scene, "list": name, "step_ms": 1e3 * cost["seconds"], **ends}
            rows.append({**row, **{key: cost[key] for key in ("rounds", *COUNTS)}})
    return rows


def overhead_of_auto(rows):
    """What a step with effects="auto" costs beyond the best list [%], by scene and at most."""
    found = {row["scene"]: row["over_best_percent"] for row in rows if row["list"] == "auto"}
    keys = {
        f"auto_overhead_{scene.replace(',', '').replace(' ', '_')}_percent": (value, "%")
        for scene, value in found.items()
    }
    return {"auto_overhead_percent": (max(found.values()), "%"), **keys}


def show_lists(rows):
    """Print what a step costs beyond that with the best list of effects."""
    print("\nScenes whose shortest list of effects is known: what a step costs beyond it")
    study.show_rows(rows, SHOWN_OF_LISTS)
