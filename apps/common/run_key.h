// --if-changed: an output is kept where it says that it was made by the same inputs, options and version.
#pragma once

#include <string>
#include <vector>

#include "apps/common/options.h"

namespace selvedge {

class RunKey {
 public:
  /// Declares the option.
  void declare(Options& options);
  bool is_given() const { return is_given_; }
  /// A digest of the version, the options but for outputs and progress, and the contents of the files that
  /// the options name, and of those that garments among them name; and of `more` files. Empty unless the
  /// option is given. A file that cannot be read counts as it is: its verb reports it.
  std::string digest(const std::vector<std::string>& more = {}) const;

 private:
  bool is_given_ = false;
  std::string words_;
  std::vector<std::string> files_;
};

}  // namespace selvedge
