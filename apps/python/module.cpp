#include "apps/python/module.h"

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include "apps/selvedge/commands.h"
#include "format/base/guard.h"
#include "format/base/progress.h"

namespace selvedge {
namespace {

/// Runs a verb of the command line; its report as JSON text. Other Python threads run meanwhile.
std::string call(const std::vector<std::string>& words, const py::object& progress) {
  if (!progress.is_none()) {
    set_progress_sink([progress](const std::string& label, double fraction) {
      const py::gil_scoped_acquire lock;
      try {
        progress(label, fraction);
      } catch (py::error_already_set& error) {
        error.discard_as_unraisable("selvedge progress");
      }
    });
  }
  Result<Json> report;
  {
    const py::gil_scoped_release unlock;
    report = guarded("", [&]() -> Result<Json> {
      Program program("selvedge", "", "");
      add_verbs(program);
      return program.call(words);
    });
  }
  set_progress_sink({});
  return report_text(taken(std::move(report)));
}

}  // namespace

void raise(const Error& error) {
  const py::object type = py::module_::import("selvedge").attr("Error");
  const py::object value =
      type(std::string(name_of(error.code)), error.file, error.place, error.message, to_line(error));
  PyErr_SetObject(type.ptr(), value.ptr());
  throw py::error_already_set();
}

}  // namespace selvedge

PYBIND11_MODULE(core, core) {
  core.attr("version") = SELVEDGE_VERSION;
  core.def("call", &selvedge::call);
  selvedge::add_fabric(core);
  selvedge::add_exr(core);
}
