// Scanline OpenEXR files as arrays, for samples files: read whole, and written back with the same values.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <Imath/half.h>

#include "apps/python/module.h"
#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/exr/exr.h"
#include "format/samples/samples.h"

namespace selvedge {
namespace {

/// One plane, (height, width), in the channel's own precision.
py::array plane_of(const std::vector<float>& values, bool half, py::ssize_t height, py::ssize_t width) {
  if (!half) return py::array_t<float>({height, width}, values.data());
  py::array array(py::dtype("float16"), {height, width});
  auto* out = static_cast<std::uint16_t*>(array.mutable_data());
  for (std::size_t i = 0; i < values.size(); ++i) out[i] = Imath::half(values[i]).bits();
  return array;
}

/// {part: (attributes, {channel: array})}, in the file's order.
py::dict read_exr(const std::string& path) {
  auto reader = value_or_raise(ExrReader::open(path));
  py::dict parts;
  for (std::size_t k = 0; k < reader.parts().size(); ++k) {
    const ExrPart& part = reader.parts()[k];
    Result<ExrPixels> pixels;
    {
      const py::gil_scoped_release unlock;
      pixels = reader.read_level(static_cast<int>(k));
    }
    const ExrPixels read = value_or_raise(std::move(pixels));
    py::dict channels;
    for (std::size_t c = 0; c < part.channels.size(); ++c)
      channels[part.channels[c].name.c_str()] =
          plane_of(read.planes[c], part.channels[c].is_half, read.height, read.width);
    py::dict attributes;
    for (const auto& [name, text] : part.attributes) attributes[name.c_str()] = text;
    parts[part.name.c_str()] = py::make_tuple(attributes, channels);
  }
  return parts;
}

/// Writes parts as read_exr() returns them. The file appears once it has been read back as a good samples
/// file.
void write_parts(const std::string& path, const py::dict& parts) {
  std::vector<ExrPart> heads;
  std::vector<ExrPixels> all;
  for (const auto& [name, value] : parts) {
    const auto [attributes, channels] = value.cast<std::pair<std::map<std::string, std::string>, py::dict>>();
    ExrPart part;
    part.name = name.cast<std::string>();
    for (const auto& [attribute, text] : attributes) part.attributes[attribute] = text;
    ExrPixels pixels;
    for (const auto& [channel, plane] : channels) {
      const auto array = plane.cast<py::array>();
      if (array.ndim() != 2) throw py::value_error("a plane is not of the shape (height, width)");
      part.channels.push_back({channel.cast<std::string>(), array.dtype().itemsize() == 2});
      const auto floats = py::array_t<float, py::array::c_style | py::array::forcecast>(array);
      pixels.height = static_cast<int>(floats.shape(0));
      pixels.width = static_cast<int>(floats.shape(1));
      pixels.planes.emplace_back(floats.data(), floats.data() + floats.size());
      if (pixels.planes.back().size() != pixels.planes.front().size())
        throw py::value_error("planes of a part have different sizes");
    }
    part.width = pixels.width;
    part.height = pixels.height;
    heads.push_back(std::move(part));
    all.push_back(std::move(pixels));
  }
  Result<void> written;
  {
    const py::gil_scoped_release unlock;
    written = catch_failure([&] {
      auto file = value_or_throw(AtomicFile::create(path));
      value_or_throw(write_exr_file(file.temporary_path(), heads, [&](int part, int) { return all[part]; }));
      value_or_throw(read_samples(file.temporary_path()));
      value_or_throw(file.commit());
    });
  }
  if (!written && written.error().file != path) written.error().file = path;
  value_or_raise(std::move(written));
}

}  // namespace

void add_exr(py::module_& core) {
  core.def("read_exr", &read_exr);
  core.def("write_samples", &write_parts);
}

}  // namespace selvedge
