#include "tests/fuzz/mutate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace selvedge::fuzz {
namespace {

using Json = nlohmann::ordered_json;

/// A value and what holds it (nothing: the root).
struct Node {
  Json* value;
  Json* parent;
};

void collect(Json& value, Json* parent, std::vector<Node>& nodes) {
  nodes.push_back({&value, parent});
  if (!value.is_structured()) return;
  for (Json& child : value) collect(child, &value, nodes);
}

Json interesting_number(Choice& choice) {
  static const std::array<Json, 6> others{1e308,
                                          -1e308,
                                          1e-320,
                                          std::numeric_limits<std::int64_t>::min(),
                                          std::numeric_limits<std::uint64_t>::max(),
                                          1e39};
  if (choice.one_in(8)) return others[choice.below(others.size())];
  // Beside a power of two, or a component type of glTF.
  static constexpr std::array odd{-1.0, -0.0, 0.5, 5121.0, 5125.0, 1e6, 1e9};
  const double number = choice.one_in(4)
                            ? odd[choice.below(odd.size())]
                            : std::exp2(choice.below(54)) + static_cast<double>(choice.below(3)) - 1;
  if (number == static_cast<double>(static_cast<std::int64_t>(number)) && !choice.one_in(8))
    return static_cast<std::int64_t>(number);
  return number;
}

void change_number(Json& value, Choice& choice) {
  if (!value.is_number_integer() || choice.one_in(2)) {
    value = interesting_number(choice);
    return;
  }
  // Unsigned: a step beyond the largest value wraps.
  const auto number = value.get<std::uint64_t>();
  value = static_cast<std::int64_t>(choice.one_in(2) ? number + 1 : number - 1);
}

void change_string(Json& value, Choice& choice, const std::vector<Node>& nodes) {
  if (choice.one_in(3)) {
    for (int i = 0; i < 8; ++i) {
      const Json& other = *nodes[choice.below(nodes.size())].value;
      if (other.is_string()) {
        value = other.get<std::string>();
        return;
      }
    }
  }
  value = choice.one_in(8) ? std::string() : mutate_bytes(value.get<std::string>(), 8);
}

/// Takes out, doubles or renames the value within what holds it.
void change_place(const Node& node, Choice& choice, const std::vector<Node>& nodes) {
  Json& parent = *node.parent;
  if (parent.is_array()) {
    const auto index = static_cast<std::ptrdiff_t>(node.value - &parent[0]);
    if (choice.one_in(2)) {
      parent.erase(static_cast<std::size_t>(index));
    } else {
      Json copy = *node.value;
      parent.insert(parent.begin() + index, std::move(copy));
    }
    return;
  }
  for (auto i = parent.begin(); i != parent.end(); ++i) {
    if (&i.value() != node.value) continue;
    const std::string key = i.key();
    Json value = std::move(i.value());
    parent.erase(key);
    if (choice.one_in(2)) return;
    const Json& other = *nodes.front().value;
    std::string name = key + "_";
    if (other.is_object() && !other.empty() && choice.one_in(2)) {
      auto some = other.begin();
      std::advance(some, static_cast<std::ptrdiff_t>(choice.below(other.size())));
      name = some.key();
    }
    parent[name] = std::move(value);
    return;
  }
}

/// Nested deeper than is safe to walk by recursion.
bool is_deep(const std::string& text) {
  int depth = 0;
  int deepest = 0;
  for (const char c : text) {
    if (c == '{' || c == '[') deepest = std::max(deepest, ++depth);
    if (c == '}' || c == ']') --depth;
  }
  return deepest > 200;
}

void change(Json& root, Choice& choice) {
  std::vector<Node> nodes;
  collect(root, nullptr, nodes);
  const Node node = nodes[choice.below(nodes.size())];
  switch (choice.below(8)) {
    case 0:
      if (node.parent != nullptr) change_place(node, choice, nodes);
      return;
    case 1: {
      Json copy = *nodes[choice.below(nodes.size())].value;
      *node.value = std::move(copy);
      return;
    }
    case 2: {
      const std::array<Json, 6> plain{Json(nullptr),  Json(true),    Json(false),
                                      Json::object(), Json::array(), Json("")};
      *node.value = plain[choice.below(plain.size())];
      return;
    }
    default:
      // Numbers and strings are most of what a reader uses; look for one.
      for (std::size_t i = 0; i < 16; ++i) {
        Json& value = *nodes[choice.below(nodes.size())].value;
        if (value.is_number()) return change_number(value, choice);
        if (value.is_string() && choice.one_in(3)) return change_string(value, choice, nodes);
      }
  }
}

}  // namespace

std::string mutate_bytes(std::string bytes, std::size_t growth) {
  const std::size_t size = bytes.size();
  bytes.resize(size + growth);
  if (bytes.empty()) return bytes;
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size()));
  return bytes;
}

std::string mutate_json(const std::string& text, Choice& choice) {
  if (is_deep(text) || text.size() > (1U << 16U)) return mutate_bytes(text, 16);
  Json root = Json::parse(text, nullptr, false);
  if (root.is_discarded()) return mutate_bytes(text, 16);
  for (std::size_t i = 0; i <= choice.below(3); ++i) change(root, choice);
  return root.dump(choice.one_in(16) ? 1 : -1, ' ', false, Json::error_handler_t::replace);
}

std::size_t give(const std::string& bytes, std::uint8_t* data, std::size_t size, std::size_t max_size) {
  if (bytes.empty() || bytes.size() > max_size) return size;
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}

}  // namespace selvedge::fuzz
