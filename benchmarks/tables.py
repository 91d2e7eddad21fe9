"""Tables in markdown of what the speed benchmark found."""

from environment import OUT
from markdown_table import table_head, table_row
from measure import REGIONS, WHERE
from results import curve, error_at, scenes_of, time_to, variants_of
from variants import BASE, VARIANTS


def write_tables(rows):
    """speed.md: how much longer others take to the same error, how much larger their error is in the same time, the errors."""
    longer = f"How many times as long as *{VARIANTS[BASE].label}* until the relMSE (without the worst 0.1 %) that it has after"
    larger = f"How many times the relMSE (without the worst 0.1 %) that *{VARIANTS[BASE].label}* has in the same time, after"
    text = ["## Time to the same error\n", longer, *_ratio_table(rows, _time_ratio),
            "\n## Error in the same time\n", larger, *_ratio_table(rows, _error_ratio),
            "\n## Errors\n", *_error_table(rows)]
    (OUT / "speed.md").write_text("\n".join(text) + "\n")


def _ratio_table(rows, ratio):
    """A row for each scene, region and variant, a column for each budget: `ratio(own, points, budget)` of both curves."""
    budgets = sorted({row["budget"] for row in rows})
    yield from table_head(("scene", "where", "variant", *(f"{budget:g} s" for budget in budgets)), texts=3)
    for scene in scenes_of(rows):
        for region in REGIONS:
            column = f"relmse_trimmed_{region}"
            own = curve(rows, scene, BASE, column)
            for variant in variants_of(rows):
                points = curve(rows, scene, variant, column)
                if own and points and variant != BASE:
                    ratios = (ratio(own, points, budget) for budget in budgets)
                    yield table_row((scene, WHERE[region], VARIANTS[variant].label, *ratios))


def _time_ratio(own, points, budget):
    mine = _at(own, budget)
    if mine is None:
        return "-"
    if mine.error <= 0:
        return "below noise"
    seconds, beyond = time_to(points, mine.error)
    return f"{beyond} {seconds / mine.seconds:.2g}".strip()


def _error_ratio(own, points, budget):
    theirs = _at(points, budget)
    mine = theirs and error_at(own, theirs.seconds)
    return f"{theirs.error / mine:.2g}" if mine else "-"


def _at(points, budget):
    return next((point for point in points if point.budget == budget), None)


def _error_table(rows):
    yield "relMSE without the worst 0.1 %: median (least to largest) of the repeats; HDR FLIP: median."
    yield from table_head(("scene", "variant", "wall s", *WHERE.values(), "FLIP"), texts=2)
    for scene in scenes_of(rows):
        for variant in variants_of(rows):
            curves = [curve(rows, scene, variant, f"relmse_trimmed_{region}") for region in REGIONS]
            for flip in curve(rows, scene, variant, "flip_all"):
                errors = (_spread(_at(points, flip.budget)) for points in curves)
                yield table_row((scene, VARIANTS[variant].label, f"{flip.seconds:.1f}", *errors, f"{flip.error:.4f}"))


def _spread(point):
    return f"{point.error:.2e} ({point.low:.1e} to {point.high:.1e})" if point else "-"


def write_references(told):
    """references.md: how good the references are; `told` maps scenes to what `reference.reference` tells."""
    columns = [f"{kind}, {where}" for where in WHERE.values() for kind in ("noise", "bias", "least")]
    text = ["Relative squared errors of the references themselves, without the worst 0.1 %. The noise is in no error's mean, the bias in",
            "all (± two standard errors). *Least* is what an error must exceed to be told from none.",
            *table_head(("scene", "iterations", "caustic pixels", *columns, "against Cycles"), texts=1)]
    for scene, values in told.items():
        errors = (cell for region in REGIONS for cell in _own_errors(values, region))
        cycles = f"{values['cycles']:.1e}" if "cycles" in values else "-"
        text.append(table_row((scene, values["iterations"], f"{values['caustic_share']:.1%}", *errors, cycles)))
    (OUT / "references.md").write_text("\n".join(text) + "\n")


def _own_errors(values, region):
    noise, bias, beside, least = (values[f"{kind}_{region}"] for kind in ("noise", "bias", "bias_uncertainty", "least"))
    return f"{noise:.1e}", f"{bias:.1e} ± {beside:.0e}", f"{least:.1e}"
