"""Selvedge: fabric appearance for glTF. Fabric files as arrays, their evaluation, and every verb of the program.

    import selvedge
    selvedge.make("plain-knit", output="k.fabric.exr", quality="draft", set={"yarn": "tube"})
    fabric = selvedge.Fabric("k.fabric.exr")
    rgb, alpha = fabric.evaluate(0, 3, 5, lights, views)

A verb takes its positional words as arguments and its options as keywords (`single_sided=True` is --single-sided), and
returns the report of --json as a dictionary. What the program refuses is raised as selvedge.Error. Frames, units and
formulas are those of spec/: unit directions point away from the cloth, radiance is in 1/sr under unit perpendicular
irradiance with the light's cosine included.
"""

import json
import os

import numpy as np


class Error(Exception):
    """A refusal: code (spec/issues.md), file, place within it, message; its text is the program's line."""

    def __init__(self, code, file, place, message, line):
        super().__init__(line)
        self.code, self.file, self.place, self.message = code, file, place, message


from . import core  # noqa: E402  (it raises Error)

__version__ = core.version


def run(verb, *words, progress=None, **options):
    """Runs a verb in this process, without Python's lock. `progress(label, fraction)` is called from any thread.

    True is a flag, None and False are left out, a list repeats an option, a dictionary repeats it as NAME=VALUE, and
    other sequences of numbers are joined by commas. The dictionary has the verb's report; `status` is 1 where the verb
    says no by its exit status (check, make with a list).
    """
    line = [verb, *map(os.fspath, words)]
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")  # for_: the other is Python's own word
        for text in _texts(value):
            line.append(option if text is True else f"{option}={text}")
    return json.loads(core.call([os.fsencode(word) for word in line], progress))


def _texts(value):
    if value is None or value is False:
        return []
    if value is True:
        return [True]
    if isinstance(value, dict):
        return [f"{name}={_word(each)}" for name, each in value.items()]
    if isinstance(value, list):
        return [_word(each) for each in value]
    return [_word(value)]


def _word(value):
    if isinstance(value, (tuple, np.ndarray)):
        return ",".join(_word(each) for each in value)
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)


def _verb(name):
    def verb(*words, progress=None, **options):
        return run(name, *words, progress=progress, **options)

    verb.__name__ = verb.__qualname__ = name
    verb.__doc__ = f"`selvedge {name}`; see run() and `selvedge {name} --help`."
    return verb


for _name in ("stitch", "import", "bake", "fit", "make", "plan", "dress", "export", "check", "info",
              "evaluate", "compare", "truth"):
    globals()[_name + "_" * (_name == "import")] = _verb(_name)  # import_: the other is Python's own word


def _pairs(lights, views):
    """Both as contiguous arrays of one shape (..., 3)."""
    lights, views = np.broadcast_arrays(np.asarray(lights, np.float32), np.asarray(views, np.float32))
    return lights, lights.reshape(-1, 3), views.reshape(-1, 3)


def _places(u, v, lights, views):
    """The shape (..., 3) of all together, and all as contiguous arrays of it."""
    u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
    lights = np.broadcast_to(lights, np.broadcast_shapes(np.shape(lights), (*u.shape, 3)))
    whole, lights, views = _pairs(lights, views)
    return (whole.shape, *(np.broadcast_to(each, whole.shape[:-1]).reshape(-1) for each in (u, v)), lights, views)


def _parted(values, shape):
    return values[:, :3].reshape(shape), values[:, 3].reshape(shape[:-1])


class Fabric:
    """A fabric file. Any number of threads may use one."""

    def __init__(self, path):
        self._take(core.open_fabric(os.fsencode(path)))

    def _take(self, opened):
        self._core = opened
        self.__dict__.update(opened.facts())
        return self

    def level(self, index):
        """The arrays of a level by name: read-only, over the fabric's own memory; those that the file has of
        parameters (h, w, rgb, rho and Cx Cy Cz n of each lobe), frames (h, w, normal and tangent, xyz),
        view_table (h, w, view, rgb), opacity (h, w, view), light_table (h, w, light, rgb), pairs (product, 2),
        coefficients (h, w, product), view_basis (function, view), light_basis (function, light, rgb)."""
        return self._core.level(index)

    def view_directions(self):
        """The stored views, (n, 3)."""
        return core.grid_directions(*self.views)

    def light_directions(self):
        """The stored lights, (n, 3)."""
        return core.grid_directions(*self.lights)

    def evaluate(self, level, x, y, lights, views):
        """Radiance (..., 3) and opacity (...) of a texel, for directions (..., 3) that are broadcast."""
        whole, lights, views = _pairs(lights, views)
        return _parted(self._core.evaluate(level, x, y, lights, views), whole.shape)

    def evaluate_at(self, level, u, v, lights, views):
        """The same at texture coordinates, numbers or arrays (...); a fractional level blends two, -1 is the yarn."""
        shape, u, v, lights, views = _places(u, v, lights, views)
        return _parted(self._core.evaluate_at(level, u, v, lights, views), shape)

    def sample_at(self, level, u, v, views, random):
        """Lights for path tracers, drawn by three numbers (..., 3) from 0 to 1 each: lights (..., 3), below the cloth
        where light comes through it; their density (...), 1/sr; weights (..., 3), radiance over density, whose mean
        is the integral of the radiance; opacity (...), not part of the weights."""
        shape, u, v, random, views = _places(u, v, random, views)
        drawn = self._core.sample_at(level, u, v, views, random)
        return (drawn[:, :3].reshape(shape), drawn[:, 3].reshape(shape[:-1]), *_parted(drawn[:, 4:], shape))

    def pdf_at(self, level, u, v, lights, views):
        """The density (...) with which sample_at() draws lights, 1/sr."""
        shape, u, v, lights, views = _places(u, v, lights, views)
        return self._core.pdf_at(level, u, v, lights, views).reshape(shape[:-1])

    def turned_over(self):
        """The cloth seen from behind: a Fabric whose z points to that viewer. The same without a side `back`."""
        return Fabric.__new__(Fabric)._take(self._core.turned_over())


class Samples:
    """A samples file (spec/samples.md) as arrays, which may be changed and saved.

    header     the attribute `selvedge.samples`, a dictionary
    radiance   (view, light, y, x, rgb), 1/sr, 0 in a hole
    opacity    (view, y, x); normal (view, y, x, xyz)
    pairs      by set ("validation", "held-out", "measured"): lights (n, 3), views (n, 3), radiance (n, y, x, rgb),
               opacity (n, y, x), noise (n, y, x, rgb and opacity)
    others     the parts that hold the yarn, as they are in the file
    """

    def __init__(self, path):
        parts = core.read_exr(os.fsencode(path))
        if "radiance" not in parts or "selvedge.samples" not in parts["radiance"][0]:
            raise Error("SAMPLES_MALFORMED", os.fspath(path), "selvedge.samples", "is missing",
                        f"{os.fspath(path)}: selvedge.samples: is missing [SAMPLES_MALFORMED]")
        self._attributes = parts["radiance"][0]
        self.header = json.loads(self._attributes["selvedge.samples"])
        w, h = self.header["texels"]
        planes = parts.pop("radiance")[1]
        atlas = np.stack([planes[c] for c in "RGB"], -1)
        self.radiance = atlas.reshape(atlas.shape[0] // h, h, -1, w, 3).swapaxes(1, 2)
        planes = parts.pop("surface")[1]
        self.opacity = planes["surface.opacity"].reshape(-1, h, w)
        self.normal = np.stack([planes["surface.n" + c] for c in "xyz"], -1).reshape(-1, h, w, 3)
        self.pairs = {}
        for kind in [name for name in parts if name in self.header["pairs"]]:
            pairs = self.header["pairs"][kind]
            planes = {name[len(kind) + 1:]: p.reshape(-1, h, w) for name, p in parts.pop(kind)[1].items()}
            self.pairs[kind] = {
                "lights": np.array([p["light"] for p in pairs], np.float32),
                "views": np.array([p["view"] for p in pairs], np.float32),
                "radiance": np.stack([planes[c] for c in _colours], -1),
                "opacity": planes["opacity"],
                "noise": np.stack([planes["noise." + c] for c in (*_colours, "opacity")], -1)}
        self.others = parts

    def save(self, path):
        """Writes the file; it appears once it has been read back as a good one. Error where it breaks a rule."""
        views, lights, h, w, _ = self.radiance.shape
        before = self.header["pairs"]
        pairs = {kind: _directions(self.pairs.get(kind, _no_pairs), before.get(kind, [])) for kind in {**before, **self.pairs}}
        header = dict(self.header, texels=[w, h], pairs=pairs)
        # What is unchanged stays to the byte.
        text = self._attributes["selvedge.samples"]
        if header != json.loads(text):
            text = json.dumps(header)
        atlas = self.radiance.swapaxes(1, 2).reshape(views * h, lights * w, 3)
        parts = {"radiance": (
            {**self._attributes, "selvedge.samples": text},
            {c: _half(atlas[..., k]) for k, c in enumerate("RGB")})}
        normal = self.normal.reshape(-1, w, 3)
        parts["surface"] = ({}, {"surface.opacity": _half(self.opacity.reshape(-1, w)),
                                 **{"surface.n" + c: _half(normal[..., k]) for k, c in enumerate("xyz")}})
        for kind, pairs in self.pairs.items():
            flat = {name: pairs[name].reshape(-1, w, n) for name, n in (("radiance", 3), ("opacity", 1), ("noise", 4))}
            planes = {c: flat["radiance"][..., k] for k, c in enumerate(_colours)}
            planes["opacity"] = flat["opacity"][..., 0]
            planes |= {"noise." + c: flat["noise"][..., k] for k, c in enumerate((*_colours, "opacity"))}
            parts[kind] = ({}, {f"{kind}.{name}": _half(plane) for name, plane in planes.items()})
        core.write_samples(os.fsencode(path), {**parts, **self.others})


_colours = ("red", "green", "blue")
_no_pairs = {"lights": np.zeros((0, 3)), "views": np.zeros((0, 3))}


def _directions(pairs, before):
    """Pairs as the header has them."""
    pairs = [{"light": l, "view": v} for l, v in zip(pairs["lights"].tolist(), pairs["views"].tolist())]
    single = [{name: np.float32(d).tolist() for name, d in pair.items()} for pair in before]
    return before if pairs == single else pairs


def _half(plane):
    return np.ascontiguousarray(plane, np.float16)
