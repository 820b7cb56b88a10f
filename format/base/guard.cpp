#include "format/base/guard.h"

#include <exception>
#include <new>
#include <stdexcept>

namespace selvedge {

Error thrown_error(const std::string& file) {
  const auto error = [&](Code code, const char* why) { return Error{code, file, "", why}; };
  try {
    throw;
  } catch (Failure& failure) {
    return std::move(failure.error);
  } catch (const std::bad_alloc&) {
    return error(Code::file_too_large, "needs more memory than there is");
  } catch (const std::length_error&) {
    return error(Code::file_too_large, "needs more memory than there can be");
  } catch (const std::exception& thrown) {
    return error(Code::file_unreadable, thrown.what());
  } catch (...) {
    return error(Code::file_unreadable, "cannot be read");
  }
}

}  // namespace selvedge
