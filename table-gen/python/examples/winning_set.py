"""Draws a slice of the winning set of the paper's C1: frequency and turbine power.

    python winning_set.py [winning-set.png]
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import holdfast

synthesis = holdfast.Spec("paper-bi").synth()
grid, ranks = synthesis.grid, synthesis.ranks("C1")

# The slice through the cells of g and l that hold 1 GW.
at = [int((1.0 - grid.lower[axis]) / grid.width[axis]) for axis in (1, 2)]
periods = ranks[:, at[0], at[1], :].astype(float)
periods[periods == holdfast.NOT_WON] = np.nan

figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
mesh = axes.pcolormesh(grid.edges("f"), grid.edges("p"), periods.T, cmap="viridis")
figure.colorbar(mesh, label="periods to I1, at most", ticks=range(int(np.nanmax(periods)) + 1))
axes.set_xlabel("deviation of frequency f [Hz]")
axes.set_ylabel("turbine power p [GW]")
axes.set_title("Winning set of C1, paper-bi, at g = l = 1 GW")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "winning-set.png", dpi=150)
