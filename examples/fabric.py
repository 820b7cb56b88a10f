"""Evaluates a fabric with NumPy, and draws lights for a path tracer: python3 fabric.py FABRIC.exr"""

import sys

import numpy as np
import selvedge

fabric = selvedge.Fabric(sys.argv[1])
lights = fabric.view_directions()                              # (views, 3), unit vectors
view = [0.0, 0.6, 0.8]
for name, array in fabric.level(0).items():                    # read-only arrays over the file's memory
    print(f"{name:12} {array.shape}")

rgb, alpha = fabric.evaluate(0, 3, 5, lights, view)            # level and texel; directions are broadcast
print("brightest from", lights[rgb.sum(axis=-1).argmax()], "with", rgb.max(axis=0))
rgb, alpha = fabric.evaluate_at(-1, 0.25, 0.5, lights, view)   # the yarn itself at u, v
print("covered" if alpha.all() else "a hole")

# Lights with a density close to the radiance; with the probability 1 - alpha the path goes straight on.
random = np.random.default_rng(1).random((10000, 3))
toward, pdf, weight, alpha = fabric.sample_at(0, 0.25, 0.5, view, random)
assert np.array_equal(pdf, fabric.pdf_at(0, 0.25, 0.5, toward, view))  # for multiple importance sampling
print("reflects", weight.mean(axis=0), "+-", weight.std(axis=0) / 100, "of white light from everywhere")
if "back" in selvedge.info(sys.argv[1])["content"].get("sides", {}):  # without: the front, for views from behind
    back = fabric.turned_over()
    print("the back", back.sample_at(0, 0.25, 0.5, view, random)[2].mean(axis=0))
