#include "apps/python/module.h"

#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <utility>

#include "apps/selvedge/commands.h"
#include "format/base/guard.h"
#include "format/base/progress.h"

namespace selvedge {
namespace {

/// Runs a verb of the command line; its report as JSON text. Other Python threads run meanwhile. An exception
/// of `progress`, such as Ctrl-C's, is raised when the verb has ended.
std::string call(const std::vector<std::string>& words, const py::object& progress) {
  std::optional<py::error_already_set> stopped;
  Result<Json> report;
  const ProgressSink sink = [&](const std::string& label, double fraction) {
    const py::gil_scoped_acquire lock;
    if (stopped) return;
    try {
      progress(label, fraction);
    } catch (py::error_already_set& error) {
      stopped.emplace(error);
    }
  };
  {
    const py::gil_scoped_release unlock;
    const auto before = std::exchange(
        progress_sink, progress.is_none() ? nullptr : std::make_shared<const ProgressSink>(std::cref(sink)));
    report = catch_exceptions("", [&]() -> Result<Json> {
      Program program("selvedge", "", "");
      add_verbs(program);
      return program.call_verb(words);
    });
    progress_sink = before;
  }
  if (stopped) throw py::error_already_set(*stopped);
  return report_text(value_or_raise(std::move(report)));
}

}  // namespace

void raise(const std::string& code, const std::string& file, const std::string& place,
           const std::string& message, const std::string& line) {
  // Names of files may be any bytes.
  const auto text = [](const std::string& bytes) {
    return py::reinterpret_steal<py::str>(
        PyUnicode_DecodeFSDefaultAndSize(bytes.data(), static_cast<py::ssize_t>(bytes.size())));
  };
  const py::object type = py::module_::import("selvedge").attr("Error");
  const py::object value = type(text(code), text(file), text(place), text(message), text(line));
  PyErr_SetObject(type.ptr(), value.ptr());
  throw py::error_already_set();
}

void raise(const Error& error) {
  raise(std::string(name_of(error.code)), error.file, error.place, error.message, to_line(error));
}

}  // namespace selvedge

PYBIND11_MODULE(core, core) {
  core.attr("version") = SELVEDGE_VERSION;
  core.def("call", &selvedge::call);
  selvedge::add_fabric(core);
  selvedge::add_exr(core);
}
