// Animations: the values that a clip of the file gives to its nodes at a time (glTF 2.0, section 3.11 and
// appendix C).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "format/gltf/access.h"

namespace selvedge {

/// A clip is read from a document, and puts its values into the document's nodes, from where read_scene()
/// takes them: a scene in motion and one at rest differ by these numbers alone.
class Clip {
 public:
  /// Keys of one sampler.
  static constexpr std::size_t max_keys = std::size_t{1} << 19;

  /// The clip of that name or number. OPTION_OUT_OF_RANGE for another one; GLTF_MALFORMED for a clip without
  /// channels, and times that go back or are not finite; MESH_NOT_FINITE for other values; FILE_TOO_LARGE
  /// beyond max_keys, or beyond `memory` bytes of numbers.
  static Result<Clip> read(const GltfDocument& document, const std::string& wanted, std::uint64_t memory);

  /// Gives the nodes the translation, rotation, scale and weights of a time (s), before the first and after
  /// the last key its values. From `seconds()` on the clip begins again. The document has no
  /// animations afterwards. Precondition: it is the document that was read.
  void pose(double time, GltfDocument& document) const;

  double seconds() const { return seconds_; }  ///< the last key
  const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  enum class Interpolation { step, linear, cubic };
  struct Channel {
    int node = 0;
    const char* path = "";
    Interpolation interpolation = Interpolation::linear;
    std::size_t components = 0;  ///< of a value
    std::shared_ptr<const std::vector<double>> times;
    std::vector<double> values;  ///< cubic: tangent, value and tangent of each key
  };
  static std::vector<double> value_at(const Channel& channel, double time);
  class Reader;

  double seconds_ = 0;
  std::vector<Channel> channels_;
  std::vector<std::string> remarks_;
};

/// The number of the entry of that name, else of that number; the first of a name counts.
/// OPTION_OUT_OF_RANGE, with the names that there are.
Result<int> find_entry(const GltfDocument& document, const char* option, const std::string& wanted,
                       const Json& entries);

}  // namespace selvedge
