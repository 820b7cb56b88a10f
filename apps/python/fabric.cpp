// Fabric files in Python: layers as arrays that share the file's memory, and evaluation of many directions.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "apps/python/module.h"
#include "format/fabric/directions.h"
#include "format/library/selvedge.h"

namespace selvedge {
namespace {

using Directions = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Triples = std::span<const std::array<float, 3>>;

struct OpenFabric {
  FabricFile file;
};

OpenFabric open_fabric(const std::string& path) {
  FabricProblem problem;
  std::optional<FabricFile> file;
  {
    const py::gil_scoped_release unlock;
    file = FabricFile::open(path, &problem);
  }
  if (!file)
    raise(problem.code, problem.file, problem.place, problem.message,
          problem.file + ": " + problem.message + " [" + problem.code + "]");
  return {std::move(*file)};
}

/// An array over the fabric's own memory, which `owner` keeps; read-only. None for an empty span.
template <class T>
py::object shared(std::span<const T> values, std::vector<py::ssize_t> shape, const py::object& owner) {
  if (values.empty()) return py::none();
  py::array_t<T> array(std::move(shape), values.data(), owner);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

py::dict level_of(const py::object& self, int level) {
  const auto& file = self.cast<const OpenFabric&>().file;
  const FabricLevelData data = file.level(level);
  if (data.width == 0) throw py::index_error("the fabric does not have this level");
  const FabricFacts& facts = file.facts();
  const py::ssize_t h = data.height;
  const py::ssize_t w = data.width;
  const py::ssize_t views = facts.view_columns * facts.view_rows;
  const py::ssize_t lights = facts.light_columns * facts.light_rows;
  py::dict all;
  const auto put = [&](const char* name, auto values, std::vector<py::ssize_t> shape) {
    if (!values.empty()) all[name] = shared(values, std::move(shape), self);
  };
  put("parameters", data.parameters, {h, w, 3, 1 + 4 * py::ssize_t{data.lobes}});
  put("frames", data.frames, {h, w, 2, 3});
  put("view_table", data.view_table, {h, w, views, 3});
  put("opacity", data.opacity, {h, w, views});
  put("light_table", data.light_table, {h, w, lights, 3});
  put("pairs", data.pairs, {data.products, 2});
  put("coefficients", data.coefficients, {h, w, data.products});
  if (views > 0)
    put("view_basis", data.view_basis, {static_cast<py::ssize_t>(data.view_basis.size()) / views, views});
  if (lights > 0)
    put("light_basis", data.light_basis,
        {static_cast<py::ssize_t>(data.light_basis.size()) / (3 * lights), lights, 3});
  return all;
}

Triples triples_of(const Directions& array, const char* name) {
  if (array.ndim() != 2 || array.shape(1) != 3)
    throw py::value_error(std::string(name) + " is not of the shape (n, 3)");
  return {reinterpret_cast<const std::array<float, 3>*>(array.data()),
          static_cast<std::size_t>(array.shape(0))};
}

/// Answers T of `answer`(a, b, out), whose numbers are floats, without the lock: (n, numbers), or (n,).
/// `first` names what is given beside the views.
template <class T, class F>
py::array_t<float> answered(const char* first, const Directions& with, const Directions& views,
                            const F& answer) {
  const Triples a = triples_of(with, first);
  const Triples v = triples_of(views, "views");
  if (a.size() != v.size())
    throw py::value_error(std::string("there are other numbers of ") + first + " and views");
  constexpr std::size_t bytes_of_number = sizeof(float);
  constexpr py::ssize_t numbers = sizeof(T) / bytes_of_number;
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(a.size())};
  if (numbers > 1) shape.push_back(numbers);
  py::array_t<float> out(std::move(shape));
  const std::span<T> values(reinterpret_cast<T*>(out.mutable_data()), a.size());
  bool good = false;
  {
    const py::gil_scoped_release unlock;
    good = answer(a, v, values);
  }
  if (!good)
    throw py::value_error("there is no such level or texel, or a number is not finite or out of its range");
  return out;
}

py::array_t<float> evaluate(const OpenFabric& fabric, int level, int x, int y, const Directions& lights,
                            const Directions& views) {
  return answered<FabricRadiance>("lights", lights, views,
                                  [&](Triples l, Triples v, std::span<FabricRadiance> out) {
                                    return fabric.file.evaluate(level, x, y, l, v, out);
                                  });
}

/// `answer`(u, v, a, b, out) of each place.
template <class T, class F>
py::array_t<float> answered_at(const Numbers& u, const Numbers& v, const char* first, const Directions& with,
                               const Directions& views, const F& answer) {
  const py::ssize_t n = with.ndim() > 0 ? with.shape(0) : 0;
  if (u.ndim() != 1 || v.ndim() != 1 || u.shape(0) != n || v.shape(0) != n)
    throw py::value_error("u and v are not of the shape (n,)");
  return answered<T>(first, with, views, [&](Triples a, Triples b, std::span<T> out) {
    for (std::size_t i = 0; i < out.size(); ++i)
      if (!answer(u.data()[i], v.data()[i], a.subspan(i, 1), b.subspan(i, 1), out.subspan(i, 1)))
        return false;
    return true;
  });
}

py::array_t<float> evaluate_at(const OpenFabric& fabric, double level, const Numbers& u, const Numbers& v,
                               const Directions& lights, const Directions& views) {
  return answered_at<FabricRadiance>(u, v, "lights", lights, views,
                                     [&](double x, double y, auto l, auto w, auto out) {
                                       return fabric.file.evaluate_at(level, x, y, l, w, out);
                                     });
}

py::array_t<float> sample_at(const OpenFabric& fabric, double level, const Numbers& u, const Numbers& v,
                             const Directions& views, const Directions& random) {
  return answered_at<FabricLightSample>(u, v, "random", random, views,
                                        [&](double x, double y, auto r, auto w, auto out) {
                                          return fabric.file.sample_at(level, x, y, w, r, out);
                                        });
}

py::array_t<float> pdf_at(const OpenFabric& fabric, double level, const Numbers& u, const Numbers& v,
                          const Directions& lights, const Directions& views) {
  return answered_at<float>(u, v, "lights", lights, views, [&](double x, double y, auto l, auto w, auto out) {
    return fabric.file.pdf_at(level, x, y, l, w, out);
  });
}

OpenFabric turned_over(const OpenFabric& fabric) {
  std::optional<FabricFile> turned;
  {
    const py::gil_scoped_release unlock;
    turned = fabric.file.turned_over();
  }
  if (!turned) throw py::value_error("too little memory");
  return {std::move(*turned)};
}

py::dict facts_of(const OpenFabric& fabric) {
  const FabricFacts& facts = fabric.file.facts();
  py::dict all;
  all["mm_per_repeat"] = facts.mm_per_repeat;
  all["reference_height_mm"] = facts.reference_height_mm;
  all["thickness_mm"] = facts.thickness_mm;
  all["levels"] = facts.levels;
  all["radiance_scale"] = facts.radiance_scale;
  all["views"] = std::pair(facts.view_columns, facts.view_rows);
  all["lights"] = std::pair(facts.light_columns, facts.light_rows);
  return all;
}

py::array_t<float> grid_directions(int columns, int rows) {
  const std::vector<V3f> all = cell_directions(DirectionGrid{columns, rows});
  py::array_t<float> array({static_cast<py::ssize_t>(all.size()), py::ssize_t{3}});
  std::copy_n(&all.data()->x, 3 * all.size(), array.mutable_data());
  return array;
}

}  // namespace

void add_fabric(py::module_& core) {
  py::class_<OpenFabric>(core, "Fabric")
      .def("facts", &facts_of)
      .def("level", &level_of)
      .def("evaluate", &evaluate)
      .def("evaluate_at", &evaluate_at)
      .def("sample_at", &sample_at)
      .def("pdf_at", &pdf_at)
      .def("turned_over", &turned_over);
  core.def("open_fabric", &open_fabric);
  core.def("grid_directions", &grid_directions);
}

}  // namespace selvedge
