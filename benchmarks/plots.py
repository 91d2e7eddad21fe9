"""Plots of error against time."""

import matplotlib.pyplot as plt
from environment import OUT
from matplotlib import ticker
from measure import REGIONS, WHERE
from results import curve, scenes_of
from variants import BASE, VARIANTS


def draw_plots(rows, told):
    """plots/SCENE.svg and .png, a panel a region; `told` maps scenes to what `reference.reference` tells."""
    plt.switch_backend("Agg")
    folder = OUT / "plots"
    folder.mkdir(parents=True, exist_ok=True)
    for scene in scenes_of(rows):
        figure, panels = plt.subplots(1, len(REGIONS), figsize=(14, 4.6), sharey=True, layout="constrained")
        for panel, region in zip(panels, REGIONS):
            _draw(panel, rows, scene, region)
            least = told.get(scene, {}).get(f"least_{region}", 0.0)
            if least > 0:
                panel.axhline(least, color="0.6", linestyle=":", label="the least that the reference can tell")
            panel.set(title=f"{scene}, {WHERE[region]}", xlabel="wall time, s", xscale="log", yscale="log")
            _tick_plainly(panel)
            panel.grid(True, which="both", color="0.9")
        panels[0].set_ylabel("relMSE without the worst 0.1 %")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize="small")
        for ending in ("svg", "png"):
            figure.savefig(folder / f"{scene}.{ending}", dpi=110)
        plt.close(figure)


def _draw(panel, rows, scene, region):
    for index, name in enumerate(VARIANTS):
        points = [p for p in curve(rows, scene, name, f"relmse_trimmed_{region}") if p.error > 0]
        if points:
            errors = [p.error for p in points]
            # A bar that would end at or below zero ends at a hundredth of its point: a logarithmic axis has no zero.
            bars = [[p.error - max(p.low, p.error / 100) for p in points], [p.high - p.error for p in points]]
            panel.errorbar([p.seconds for p in points], errors, bars, marker="o", markersize=4, capsize=3, color=f"C{index}",
                           linewidth=2.2 if name == BASE else 1.2, label=VARIANTS[name].label)


def _tick_plainly(panel):
    """Seconds as 2, 5, 10, 20, ..., instead of powers of ten."""
    panel.xaxis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
    panel.xaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
    panel.xaxis.set_minor_formatter(ticker.NullFormatter())
