// The Python module's core; selvedge.py around it is what users import.
#pragma once

#include <pybind11/pybind11.h>

#include "format/base/error.h"

namespace selvedge {

namespace py = pybind11;

/// Raises selvedge.Error with code, file, place and message.
[[noreturn]] void raise(const Error& error);
[[noreturn]] void raise(const std::string& code, const std::string& file, const std::string& place,
                        const std::string& message, const std::string& line);

/// The value, or raise().
template <class T>
T value_or_raise(Result<T> result) {
  if (!result) raise(result.error());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

void add_fabric(py::module_& core);
void add_exr(py::module_& core);

}  // namespace selvedge
