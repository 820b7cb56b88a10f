"""The Python module beside the programs: python3 module_test.py BUILD (the build folder)."""

import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

build = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(build / "python"))
import selvedge  # noqa: E402

small = dict(quality="draft", texels=8, views=16, lights=16, samples=4, pairs=16,
             truth_samples=8, set={"yarn": "tube"})


def directions(n, seed):
    d = np.random.default_rng(seed).normal(size=(n, 3))
    d[:, 2] = np.abs(d[:, 2]) + 0.05
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


class Module(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        os.chdir(cls.folder.name)
        cls.told = []
        cls.made = selvedge.make("plain-knit", output="k.fabric.exr", keep_samples="k.samples.exr", **small,
                                 progress=lambda label, fraction: cls.told.append((label, fraction)))

    @classmethod
    def tearDownClass(cls):
        os.chdir("/")
        cls.folder.cleanup()

    def test_a_verb_does_what_the_program_does(self):
        program = build / "bin" / "selvedge"
        words = [f"--{k.replace('_', '-')}={v}" for k, v in small.items() if k != "set"]
        subprocess.run([program, "make", "plain-knit", "--set", "yarn=tube", "-o", "program.fabric.exr", "--quiet", *words],
                       check=True)
        self.assertEqual(pathlib.Path("k.fabric.exr").read_bytes(), pathlib.Path("program.fabric.exr").read_bytes())
        said = json.loads(subprocess.run([program, "info", "k.fabric.exr", "--json"], check=True, capture_output=True).stdout)
        self.assertEqual({**said, "status": 0}, selvedge.info("k.fabric.exr"))
        self.assertEqual(self.made["fit"]["bytes"], os.path.getsize("k.fabric.exr"))
        self.assertIn("bake", {label for label, _ in self.told})
        self.assertTrue(all(0 <= fraction <= 1 for _, fraction in self.told))

    def test_evaluation_is_that_of_the_program(self):
        fabric = selvedge.Fabric("k.fabric.exr")
        lights, views = directions(20, 1), directions(20, 2)
        words = lambda d: ",".join(f"{x:.9g}" for x in np.float32(d))
        rgb, alpha = fabric.evaluate(1, 2, 3, lights, views)
        self.assertEqual((rgb.shape, alpha.shape), ((20, 3), (20,)))
        for k in range(20):
            said = selvedge.evaluate("k.fabric.exr", level=1, texel="2,3", light=words(lights[k]), view=words(views[k]))
            np.testing.assert_allclose(rgb[k], said["rgb"], rtol=1e-5, atol=1e-7)
            self.assertAlmostEqual(float(alpha[k]), said["alpha"], 6)
        # Broadcast, at coordinates, and of the yarn itself.
        rgb, alpha = fabric.evaluate_at(-1, 0.3, 0.6, lights[:, None], views[None])
        self.assertEqual((rgb.shape, alpha.shape), ((20, 20, 3), (20, 20)))
        one, _ = fabric.evaluate_at(-1, 0.3, 0.6, lights[3], views[7])
        np.testing.assert_array_equal(rgb[3, 7], one)
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            each = list(pool.map(lambda _: fabric.evaluate_at(0, 0.3, 0.6, lights, views)[0], range(8)))
        self.assertTrue(all(np.array_equal(a, each[0]) for a in each))

    def test_the_example_prints_what_the_module_gives(self):
        example = pathlib.Path(__file__).resolve().parents[2] / "examples" / "fabric.py"
        said = subprocess.run([sys.executable, example, "k.fabric.exr"], env={**os.environ, "PYTHONPATH": str(build / "python")},
                              check=True, capture_output=True, text=True).stdout
        random = np.random.default_rng(2).random((10000, 3))
        weight = selvedge.Fabric("k.fabric.exr").sample_at(0, 0.25, 0.5, [0, 0.6, 0.8], random)[2]
        mean, error = (np.array(text.split(), float) for text in re.search(r"reflects \[(.*)\] \+- \[(.*)\] of", said).groups())
        self.assertTrue(np.all(np.abs(mean - weight.mean(axis=0)) < 6 * error))

    def test_lights_are_drawn_with_their_density(self):
        fabric = selvedge.Fabric("k.fabric.exr")
        random = np.random.default_rng(5).random((20000, 3), np.float32)
        for level in (0, 0.5, -1):
            view = directions(1, 6)[0]
            lights, pdf, weights, alpha = fabric.sample_at(level, 0.3, 0.6, view, random)
            self.assertEqual((lights.shape, pdf.shape, weights.shape, alpha.shape), ((20000, 3), (20000,), (20000, 3), (20000,)))
            rgb, opacity = fabric.evaluate_at(level, 0.3, 0.6, lights, view)
            np.testing.assert_allclose(weights * pdf[:, None], rgb, rtol=1e-6)
            np.testing.assert_array_equal(alpha, opacity)
            np.testing.assert_array_equal(pdf, fabric.pdf_at(level, 0.3, 0.6, lights, view))
        # Places and views are broadcast; threads have the same answers.
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            each = list(pool.map(lambda _: fabric.sample_at(0, [0.1, 0.2], 0.5, directions(2, 7), random[:2]), range(8)))
        for k in range(2):
            one = fabric.sample_at(0, [0.1, 0.2][k], 0.5, directions(2, 7)[k], random[k])
            self.assertTrue(all(np.array_equal(a, b[k]) for given in each for a, b in zip(one, given)))
        for bad in ([0.5, 0.5, 1.1], [0.5, -0.1, 0], [np.nan, 0, 0]):
            with self.assertRaises(ValueError):
                fabric.sample_at(0, 0, 0, [0, 0, 1], bad)
        behind = fabric.turned_over()
        self.assertEqual(behind.levels, fabric.levels)
        np.testing.assert_array_equal(*(f.evaluate_at(0, 0.1, 0.1, view, view)[0] for f in (fabric, behind)))

    def test_layers_are_arrays_over_the_file(self):
        fabric = selvedge.Fabric("k.fabric.exr")
        level = fabric.level(0)
        self.assertEqual(level["frames"].shape, (8, 8, 2, 3))
        self.assertEqual(fabric.level(0)["frames"].__array_interface__["data"], level["frames"].__array_interface__["data"])
        self.assertFalse(level["frames"].flags.writeable)
        self.assertEqual(fabric.view_directions().shape, (16, 3))
        del fabric  # the arrays keep it
        np.testing.assert_allclose(np.linalg.norm(level["frames"], axis=-1), 1, atol=2e-3)
        with self.assertRaises(IndexError):
            selvedge.Fabric("k.fabric.exr").level(9)

    def test_samples_go_out_and_in(self):
        samples = selvedge.Samples("k.samples.exr")
        self.assertEqual(samples.radiance.shape, (16, 16, 8, 8, 3))
        samples.save("again.samples.exr")
        a, b = selvedge.core.read_exr("k.samples.exr"), selvedge.core.read_exr("again.samples.exr")
        self.assertEqual(list(a), list(b))
        for part in a:
            self.assertEqual(a[part][0], b[part][0])
            for channel in a[part][1]:
                self.assertEqual(a[part][1][channel].tobytes(), b[part][1][channel].tobytes())
        selvedge.fit("again.samples.exr", output="again.fabric.exr", quality="draft")
        selvedge.fit("k.samples.exr", output="fitted.fabric.exr", quality="draft")
        self.assertEqual(pathlib.Path("again.fabric.exr").read_bytes(), pathlib.Path("fitted.fabric.exr").read_bytes())
        # By NumPy's own file, brighter: so is the fit.
        np.savez("k.npz", radiance=samples.radiance)
        samples.radiance = np.load("k.npz")["radiance"] * np.float16(0.5)
        for pairs in samples.pairs.values():
            pairs["radiance"] = pairs["radiance"] * np.float16(0.5)
        samples.others.clear()
        del samples.header["yarns"]
        samples.save("half.samples.exr")
        selvedge.fit("half.samples.exr", output="half.fabric.exr", quality="draft")
        lights, views = directions(200, 3), directions(200, 4)
        whole, half = (selvedge.Fabric(f).evaluate(2, 0, 0, lights, views)[0].mean() for f in ("fitted.fabric.exr", "half.fabric.exr"))
        self.assertAlmostEqual(half / whole, 0.5, 2)

    def test_verbs_run_side_by_side(self):
        def make(k):
            told = []
            selvedge.make("plain-knit", output=f"side{k}.fabric.exr", seed=k, **small,
                          progress=lambda label, fraction: (told.append(label), selvedge.info("k.fabric.exr")))
            return told

        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            self.assertTrue(all("bake" in told for told in pool.map(make, range(3))))

        def stop(label, fraction):
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            selvedge.make("plain-knit", output="stopped.fabric.exr", **small, progress=stop)
        odd = os.fsdecode(b"\xff.fabric.exr")
        os.link("k.fabric.exr", odd)
        self.assertEqual(selvedge.Fabric(odd).levels, selvedge.Fabric("k.fabric.exr").levels)
        with self.assertRaises(selvedge.Error):
            selvedge.Fabric(os.fsdecode(b"\xfe.fabric.exr"))
        rgb, _ = selvedge.Fabric(odd).evaluate_at(0, [0.1, 0.2, 0.3], 0.4, [0, 0, 1], [0, 0, 1])
        self.assertEqual(rgb.shape, (3, 3))

    def test_refusals_are_exceptions(self):
        cases = [("STITCH_UNKNOWN", "nope", "", lambda: selvedge.make("nope", output="x.exr")),
                 ("FILE_MISSING", "none.exr", "", lambda: selvedge.Fabric("none.exr")),
                 ("OPTION_OUT_OF_RANGE", "", "usage", lambda: selvedge.make("rib")),
                 ("OPTION_OUT_OF_RANGE", "rib", "views", lambda: selvedge.make("rib", output="x.exr", views=-3)),
                 ("SAMPLES_MALFORMED", "k.fabric.exr", "selvedge.samples", lambda: selvedge.Samples("k.fabric.exr"))]
        for code, file, place, call in cases:
            with self.assertRaises(selvedge.Error) as raised:
                call()
            error = raised.exception
            self.assertEqual((error.code, error.file, error.place), (code, file, place))
            self.assertIn(f"[{code}]", str(error))
        samples = selvedge.Samples("k.samples.exr")
        samples.radiance[0, 0, 0, 0, 0] = np.nan
        with self.assertRaises(selvedge.Error):
            samples.save("bad.samples.exr")
        self.assertFalse(os.path.exists("bad.samples.exr"))
        pathlib.Path("bad.exr").write_bytes(b"no fabric")
        self.assertEqual(selvedge.check("bad.exr")["status"], 1)
        with self.assertRaises(ValueError):
            selvedge.Fabric("k.fabric.exr").evaluate(0, 0, 0, [0, 0, np.nan], [0, 0, 1])


if __name__ == "__main__":
    unittest.main()
