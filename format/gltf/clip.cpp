#include "format/gltf/clip.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "format/base/guard.h"
#include "format/gltf/memory.h"

namespace selvedge {
namespace {

bool is_rotation(const char* path) { return std::string_view(path) == "rotation"; }

void make_unit(std::vector<double>& value) {
  double square = 0;
  for (const double x : value) square += x * x;
  if (square > 0)
    for (double& x : value) x /= std::sqrt(square);
}

/// Between two quaternions along the shorter arc. Keys that are not quite unit stay so, as in three.js.
void slerp(const double* a, const double* b, double s, std::vector<double>& value) {
  constexpr double nearly_equal = 0.9995;
  if (std::equal(a, a + 4, b)) return;  // `value` is a
  double cosine = 0;
  for (int c = 0; c < 4; ++c) cosine += a[c] * b[c];
  const double sign = cosine < 0 ? -1 : 1;
  const bool is_near = std::abs(cosine) >= nearly_equal;
  const double angle = is_near ? 1 : std::acos(std::abs(cosine));
  const double of_a = is_near ? 1 - s : std::sin((1 - s) * angle) / std::sin(angle);
  const double of_b = sign * (is_near ? s : std::sin(s * angle) / std::sin(angle));
  for (int c = 0; c < 4; ++c) value[c] = of_a * a[c] + of_b * b[c];
  if (is_near) make_unit(value);
}

}  // namespace

class Clip::Reader {
 public:
  Reader(const GltfDocument& document, int number, std::uint64_t memory)
      : reader_(document),
        json_(document.json["animations"][number]),
        place_(fmt::format("/animations/{}", number)),
        memory_(memory) {}

  Clip read() {
    Clip clip;
    const Json& channels = array_member(json_, "channels");
    if (channels.empty()) reader_.fail(Code::gltf_malformed, place_, "the clip has no channels");
    for (std::size_t i = 0; i < channels.size(); ++i) read_channel(i, channels[i], clip);
    return clip;
  }

 private:
  void read_channel(std::size_t number, const Json& json, Clip& clip) {
    const std::string place = fmt::format("{}/channels/{}", place_, number);
    const Json& target = member(json, "target");
    const std::string wanted = string_of(member(target, "path"));
    static constexpr std::array paths{"translation", "rotation", "scale", "weights"};
    const auto path = static_cast<std::size_t>(std::ranges::find(paths, wanted) - paths.begin());
    if (path == paths.size()) {
      const std::string remark = fmt::format("animation channels of \"{}\" are not played", wanted);
      if (std::ranges::find(clip.remarks_, remark) == clip.remarks_.end()) clip.remarks_.push_back(remark);
      return;
    }
    if (member(target, "node").is_null()) return;  // glTF: of an extension that is not read
    Channel channel;
    channel.node = index_of(member(target, "node"));
    channel.path = paths[path];
    const Json& node = reader_.entry("nodes", channel.node, place + "/target/node");
    if (wanted == "weights" && member(node, "mesh").is_null()) return;
    if (wanted != "weights" && !member(node, "matrix").is_null())
      reader_.fail(Code::gltf_malformed, place, fmt::format("/nodes/{} has a matrix", channel.node));
    channel.components = components_of(wanted, node);
    const int sampler = index_of(member(json, "sampler"));
    const Json& samplers = array_member(json_, "samplers");
    if (sampler < 0 || static_cast<std::size_t>(sampler) >= samplers.size())
      reader_.fail(Code::gltf_accessor, place + "/sampler", "there is no such sampler");
    read_sampler(samplers[sampler], fmt::format("{}/samplers/{}", place_, sampler), channel);
    clip.seconds_ = std::max(clip.seconds_, channel.times->back());
    clip.channels_.push_back(std::move(channel));
  }

  std::size_t components_of(const std::string& path, const Json& node) {
    if (path == "rotation") return 4;
    if (path != "weights") return 3;
    const Json& mesh = root_entry(reader_.document, "meshes", index_of(member(node, "mesh")));
    const Json& primitives = array_member(mesh, "primitives");
    return primitives.empty() ? 0 : array_member(primitives[0], "targets").size();
  }

  void read_sampler(const Json& json, const std::string& place, Channel& channel) {
    const std::string name = json.contains("interpolation") ? string_of(json["interpolation"]) : "LINEAR";
    static constexpr std::array names{"STEP", "LINEAR", "CUBICSPLINE"};
    const auto found = std::ranges::find(names, name) - names.begin();
    if (found == std::ssize(names))
      reader_.fail(Code::gltf_malformed, place + "/interpolation", fmt::format("\"{}\" is unknown", name));
    channel.interpolation = static_cast<Interpolation>(found);
    channel.times = read_times(index_of(member(json, "input")), place + "/input");
    const std::string where = place + "/output";
    channel.values = numbers(index_of(member(json, "output")), where, Code::mesh_not_finite);
    const std::size_t of_key = channel.components * (channel.interpolation == Interpolation::cubic ? 3 : 1);
    if (channel.values.size() != of_key * channel.times->size())
      reader_.fail(
          Code::gltf_malformed, where,
          fmt::format("{} numbers for {} keys of {}", channel.values.size(), channel.times->size(), of_key));
  }

  /// Samplers share their times.
  std::shared_ptr<const std::vector<double>> read_times(int accessor, const std::string& place) {
    auto& times = times_[accessor];
    if (times) return times;
    const std::size_t keys = reader_.accessor_shape(accessor, place).count;
    if (keys > max_keys)
      reader_.fail(Code::file_too_large, place, fmt::format("{} keys are more than {}", keys, max_keys));
    std::vector<double> read = numbers(accessor, place, Code::gltf_malformed);
    if (read.size() != keys || keys == 0)
      reader_.fail(Code::gltf_malformed, place, "the times of keys are not a list of numbers");
    const auto back = std::ranges::adjacent_find(read, std::greater());
    if (back != read.end())
      reader_.fail(Code::gltf_malformed, place,
                   fmt::format("key {} is before the key that precedes it", back - read.begin() + 1));
    times = std::make_shared<const std::vector<double>>(std::move(read));
    return times;
  }

  std::vector<double> numbers(int accessor, const std::string& place, Code not_finite) {
    const AccessorShape shape = reader_.accessor_shape(accessor, place);
    if (!memory_.try_spend(shape.count * static_cast<std::size_t>(shape.components), sizeof(double)))
      throw Failure{memory_limit_error(reader_.document.file, place, "its keys", memory_.limit())};
    std::vector<double> read = reader_.numbers(accessor, place);
    const auto odd = std::ranges::find_if(read, [](double x) { return !std::isfinite(x); });
    if (odd != read.end())
      reader_.fail(not_finite, place, fmt::format("number {} is NaN or infinite", odd - read.begin()));
    return read;
  }

  GltfReader reader_;
  const Json& json_;
  std::string place_;
  MemoryBudget memory_;
  std::map<int, std::shared_ptr<const std::vector<double>>> times_;  ///< by accessor
};

Result<Clip> Clip::read(const GltfDocument& document, const std::string& wanted, std::uint64_t memory) {
  const Result<int> number =
      find_entry(document, "--animation", wanted, array_member(document.json, "animations"));
  if (!number) return tl::unexpected<Error>(number.error());
  return catch_failure([&] { return Reader(document, *number, memory).read(); });
}

std::vector<double> Clip::value_at(const Channel& channel, double time) {
  const std::vector<double>& times = *channel.times;
  const bool is_cubic = channel.interpolation == Interpolation::cubic;
  const std::size_t n = channel.components;
  const auto value = [&](std::size_t key) { return &channel.values[is_cubic ? (3 * key + 1) * n : key * n]; };
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(times, time) - times.begin());
  const std::size_t key = next > 0 ? next - 1 : 0;
  std::vector<double> result(value(key), value(key) + n);
  const bool is_between = next > 0 && next < times.size();
  if (is_between && channel.interpolation != Interpolation::step) {
    const double step = times[next] - times[key];
    const double s = (time - times[key]) / step;
    if (is_cubic) {
      const double s2 = s * s;
      const double s3 = s2 * s;
      const double *a = value(key), *b = value(next), *out = a + n, *in = b - n;
      for (std::size_t c = 0; c < n; ++c)
        result[c] = (2 * s3 - 3 * s2 + 1) * a[c] + step * (s3 - 2 * s2 + s) * out[c] +
                    (3 * s2 - 2 * s3) * b[c] + step * (s3 - s2) * in[c];
      if (is_rotation(channel.path)) make_unit(result);
    } else if (is_rotation(channel.path)) {
      slerp(value(key), value(next), s, result);
    } else {
      for (std::size_t c = 0; c < n; ++c) result[c] += s * (value(next)[c] - result[c]);
    }
  }
  return result;
}

void Clip::pose(double time, GltfDocument& document) const {
  if (time > seconds_) time = seconds_ > 0 ? std::fmod(time, seconds_) : 0;
  for (const Channel& channel : channels_)
    document.json["nodes"][channel.node][channel.path] = value_at(channel, time);
  document.json.erase("animations");
}

Result<int> find_entry(const GltfDocument& document, const char* option, const std::string& wanted,
                       const Json& entries) {
  int found = -1;
  std::string present;
  for (int i = static_cast<int>(entries.size()) - 1; i >= 0; --i) {
    // The first entry of that name; names come before numbers.
    const std::string name = string_of(member(entries[i], "name"));
    if (name == wanted || (found < 0 && std::to_string(i) == wanted)) found = i;
    present = fmt::format("{} \"{}\"{}{}", i, name, present.empty() ? "" : ", ", present);
  }
  if (found >= 0) return found;
  return fail(Code::option_out_of_range, document.file, option,
              fmt::format("there is no \"{}\"; the file has {}", wanted, present.empty() ? "none" : present));
}

}  // namespace selvedge
