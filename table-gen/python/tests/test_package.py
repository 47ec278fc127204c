"""The package as it is installed: the paper's counts, tables, proofs, runs; with the standard library alone."""

import time
import unittest
from pathlib import Path

began = time.perf_counter()
import holdfast  # noqa: E402

IMPORT_S = time.perf_counter() - began

import numpy as np  # noqa: E402

TABLES = Path(__file__).parents[3] / "firmware" / "tables"
# The cells that the paper's two cases win, as tests/tests/reference_counts.rs has them: the first as
# shipped, the others without containment, the last on the grid as printed.
FREE = {"requirements.containment_hz": None}
PRINTED = {**FREE, "grid.upper": [0.1, 2.0, 2.0, 3.0], "sampling.period_s": 1.5}
COUNTS = [
    ("paper-bi", {}, (1_042_103, 1_349_726)),
    ("paper-bi", FREE, (1_075_271, 1_382_894)),
    ("paper-uni", PRINTED, (467_763, 583_097)),
]


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.spec = holdfast.Spec("paper-bi")
        cls.synthesis = cls.spec.synth()
        cls.table = cls.synthesis.table()

    def test_the_papers_winning_counts(self):
        for name, overrides, expected in COUNTS:
            synthesis = holdfast.Spec(name, overrides).synth()
            found = tuple(int(synthesis.winning(law).sum()) for law in synthesis.laws)
            self.assertEqual(found, expected, name)
            self.assertEqual(found, tuple(p["winning_cells"] for p in synthesis.problems))

    def test_axes_are_in_order(self):
        grid, ranks = self.synthesis.grid, self.synthesis.ranks("C1")
        self.assertEqual(ranks.shape, grid.count)
        # The target, rank 0, is whole slices along f: the cells inside I1 = [-0.3, 0].
        target = ranks == 0
        self.assertTrue((target.all(axis=(1, 2, 3)) == target.any(axis=(1, 2, 3))).all())
        edges = grid.edges("f")
        inside = (edges[:-1] >= -0.3 - 1e-9) & (edges[1:] <= 1e-9)
        np.testing.assert_array_equal(target.any(axis=(1, 2, 3)), inside)
        self.assertEqual(len(grid.centres("p")), grid.count[3])

    def test_a_cell_has_inputs_where_it_wins(self):
        inputs = self.synthesis.inputs("C1")
        np.testing.assert_array_equal(inputs != 0, self.synthesis.winning("C1"))

    def test_a_table_is_proven_and_a_changed_one_is_refused(self):
        verdict = self.table.verify(self.spec)
        self.assertTrue(verdict["verified"])
        self.assertEqual(verdict["table_bytes"], len(self.table))
        other = bytearray(self.table.data)
        other[-10] ^= 1
        with self.assertRaises(ValueError):
            holdfast.Table(bytes(other)).verify(self.spec)

    def test_runs_are_those_of_the_command_line(self):
        run = self.spec.simulate(self.table)
        self.assertEqual(run.keys()[0], "time_s")
        columns = dict(run)
        self.assertEqual({len(column) for column in columns.values()}, {len(run["time_s"])})
        self.assertLessEqual(run.summary["nadir_hz"], run.frequency_hz.min())
        droop = self.spec.simulate(controller="baseline")
        # The paper's droop at 2 GW.
        self.assertAlmostEqual(droop.summary["nadir_hz"], 49.4920, delta=0.0005)
        rows = holdfast.compare(self.spec, self.table, [1.0, 2.0])
        self.assertEqual([row["controller"] for row in rows], ["none", "droop", "table"] * 2)

    def test_a_response_is_a_table_without_games(self):
        spec = holdfast.Spec("gb-bi")
        self.assertEqual(spec.table().data, (TABLES / "gb-bi.bin").read_bytes())
        with self.assertRaisesRegex(RuntimeError, "no game"):
            spec.synth()
        rows = holdfast.compare(spec, spec.table(), [2.2])
        none, droop, table = (row["nadir_hz"] for row in rows)
        self.assertTrue(none < droop < table)

    def test_specs_are_overridden_and_bad_ones_named(self):
        spec = holdfast.Spec("paper-bi", {"plant.inertia_gw_s_per_hz": 3, "name": "mine"})
        self.assertEqual(spec.name, "mine")
        self.assertEqual(spec.to_dict()["plant"]["inertia_gw_s_per_hz"], 3.0)
        self.assertIn("inertia_gw_s_per_hz = 3.0", spec.toml())
        self.assertNotEqual(spec.hash, self.spec.hash)
        with self.assertRaisesRegex(ValueError, "no_such_key"):
            holdfast.Spec("paper-bi", {"plant.no_such_key": 1})
        with self.assertRaises(ValueError):
            self.synthesis.ranks("Hold")
        with self.assertRaises(ValueError):
            self.spec.simulate(controller="symbolic")

    def test_it_imports_quickly(self):
        # numpy is most of it; a cold disk may take its time.
        print(f"import: {IMPORT_S:.2f} s")
        self.assertLess(IMPORT_S, 10)


if __name__ == "__main__":
    unittest.main()
