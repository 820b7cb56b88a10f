#include "format/base/guard.h"

#include <exception>
#include <new>
#include <stdexcept>

#include "format/base/json_text.h"

namespace selvedge {

Error thrown_error(const std::string& file) {
  const auto error = [&](Code code, std::string why) { return Error{code, file, "", std::move(why)}; };
  try {
    throw;
  } catch (Failure& failure) {
    return std::move(failure.error);
  } catch (const std::bad_alloc&) {
    return error(Code::file_too_large, "needs more memory than there is");
  } catch (const std::length_error&) {
    return error(Code::file_too_large, "needs more memory than there can be");
  } catch (const std::exception& thrown) {
    return error(Code::file_unreadable, exception_message(thrown));
  } catch (...) {
    return error(Code::file_unreadable, "cannot be read");
  }
}

}  // namespace selvedge
