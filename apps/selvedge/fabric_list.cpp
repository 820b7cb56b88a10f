#include "apps/selvedge/fabric_list.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>

#include "apps/common/options.h"
#include "apps/selvedge/made_of.h"
#include "format/base/atomic_file.h"
#include "format/base/json_text.h"
#include "format/base/printable.h"

namespace selvedge {
namespace {

using nlohmann::json;

constexpr std::uintmax_t max_list_bytes = std::uintmax_t{64} << 20;

/// Options of make that are not those of one fabric of many.
const std::set<std::string, std::less<>> no_place_in_list{
    "list",    "task",         "parts", "dry-run", "keep-going", "page", "shard",
    "depfile", "keep-samples", "json",  "quiet",   "threads",    "help"};

bool is_flag(const std::string& name) {
  return name == "no-table" || name == "half-lobes" || name == "float-tables";
}

class ListReader {
 public:
  explicit ListReader(const std::string& path)
      : path_(path), folder_(std::filesystem::path(path).parent_path()) {}

  Result<std::vector<ListedFabric>> read() {
    const json list = must(parse_json_object(must(read_file(path_, max_list_bytes)), path_));
    refuse_controls(list, "");
    for (const auto& [name, value] : list.items()) {
      if (name != "fabrics" && name != "defaults")
        refuse(pointer_to("", name), "is neither \"defaults\" nor \"fabrics\"");
    }
    const json defaults = list.value("defaults", json::object());
    if (!defaults.is_object()) refuse("/defaults", "is no object");
    if (!list.contains("fabrics") || !list["fabrics"].is_array()) refuse("/fabrics", "is no list");
    for (std::size_t i = 0; i < list["fabrics"].size(); ++i) {
      const std::string place = fmt::format("/fabrics/{}", i);
      const json& fabric = list["fabrics"][i];
      if (!fabric.is_object()) refuse(place, "is no object");
      const json whole = laid_over(defaults, fabric);
      if (!whole.contains("variants") || whole["variants"].is_null()) {
        add(whole, place, "");
        continue;
      }
      if (!whole["variants"].is_object()) refuse(place + "/variants", "is no object");
      for (const auto& [name, variant] : whole["variants"].items()) {
        const std::string at = pointer_to(place + "/variants", name);
        if (!variant.is_object() || variant.contains("variants")) refuse(at, "is no object of options");
        if (name.find('/') != std::string::npos) refuse(at, "has a name with a slash");
        add(laid_over(whole, variant), at, name);
      }
    }
    inputs_.emplace(identity_of(path_), path_);
    for (const auto& [file, place] : outputs_) {
      if (const auto read = inputs_.find(file); read != inputs_.end())
        refuse(place, fmt::format("writes over {}, which the list reads", read->second));
    }
    return std::move(fabrics_);
  }

 private:
  [[noreturn]] void refuse(const std::string& place, const std::string& why) const {
    throw Failure{{Code::json_malformed, path_, place, why}};
  }

  /// Refuses texts that end a path or a line, or that a terminal acts upon.
  void refuse_controls(const json& value, const std::string& place) const {
    const auto check = [&](const std::string& text) {
      if (printable(text) != text || text.find_first_of("\t\n") != std::string::npos)
        refuse(place, "has a control character");
    };
    if (value.is_string()) check(value.get<std::string>());
    if (!value.is_structured()) return;
    for (const auto& [name, item] : value.items()) {
      if (value.is_object()) check(name);
      refuse_controls(item, pointer_to(place, name));
    }
  }

  /// The members of both, of `upper` where both have one; those of "set" one by one.
  static json laid_over(const json& lower, const json& upper) {
    json both = lower;
    both.update(upper);
    if (lower.contains("set") && upper.contains("set") && lower["set"].is_object() &&
        upper["set"].is_object()) {
      both["set"] = lower["set"];
      both["set"].update(upper["set"]);
    }
    return both;
  }

  std::string in_folder(const std::string& path) const { return (folder_ / path).string(); }

  /// A value as a word of a command line.
  std::string word_of(const json& value, const std::string& place) const {
    if (value.is_string() && !value.get<std::string>().empty()) return value.get<std::string>();
    if (value.is_number()) return value.dump();
    if (!value.is_array() || value.empty()) refuse(place, "is neither text, a number nor a list of them");
    std::string text;
    for (const json& item : value) {
      if (item.is_array()) refuse(place, "is a list of lists");
      text += fmt::format("{}{}", text.empty() ? "" : ",", word_of(item, place));
    }
    return text;
  }

  std::string text_of(const json& fabric, const char* name, const std::string& place) const {
    if (!fabric.contains(name) || !fabric[name].is_string())
      refuse(place, fmt::format("has no text \"{}\"", name));
    return fabric[name].get<std::string>();
  }

  /// The words of an option.
  void append(std::vector<std::string>& words, const std::string& name, const json& value,
              const std::string& place) const {
    const std::string option = fmt::format("--{}", name);
    const std::string at = pointer_to(place, name);
    // What comes after it would be the value of an option that has no place in a list.
    if (name.find('=') != std::string::npos) refuse(at, "is no option");
    if (name == "set") {
      if (!value.is_object()) refuse(at, "is no object");
      for (const auto& [setting, to] : value.items()) {
        if (!to.is_null()) words.push_back(fmt::format("{}={}={}", option, setting, word_of(to, at)));
      }
    } else if (value == true && is_flag(name)) {
      words.push_back(option);
    } else if (value.is_boolean()) {
      if (value == true || !is_flag(name)) refuse(at, "is no option that is true or false");
    } else if (name == "material" && value.is_array()) {
      for (const json& item : value) words.push_back(option + "=" + word_of(item, at));
    } else if (name == "for") {
      words.push_back(option + "=" + in_folder(word_of(value, at)));
    } else {
      words.push_back(option + "=" + word_of(value, at));
    }
  }

  void add(const json& fabric, const std::string& place, const std::string& variant) {
    ListedFabric listed;
    listed.place = place;
    const std::string stitch = text_of(fabric, "stitch", place);
    if (stitch.starts_with('-')) refuse(pointer_to(place, "stitch"), "begins as an option does");
    // What has no ending is the name of a built-in stitch.
    const bool is_file = std::filesystem::path(stitch).has_extension();
    std::vector<std::string> words = {is_file ? in_folder(stitch) : stitch};
    std::string output = text_of(fabric, "output", place);
    constexpr std::string_view mark = "{variant}";
    for (std::size_t at = 0; (at = output.find(mark, at)) != std::string::npos; at += variant.size())
      output.replace(at, mark.size(), variant);
    output = in_folder(output);
    for (const auto& [name, value] : fabric.items()) {
      if (name == "stitch" || name == "output" || name == "variants" || value.is_null()) continue;
      if (no_place_in_list.contains(name)) refuse(pointer_to(place, name), "has no place in a list");
      if (name == "shards") {
        if (!value.is_number_integer() || value < 1 || value > 4096)
          refuse(pointer_to(place, name), "is no number of parts from 1 to 4096");
        listed.shards = value;
      } else {
        append(words, name, value, place);
      }
    }
    words.push_back("--output=" + output);
    listed.command = must(make_command_of(words, path_, place));
    if (listed.shards > 1 && listed.command.limits.any())
      refuse(pointer_to(place, "shards"), "excludes max-bytes, min-db and max-seconds");
    const auto [before, is_new] = outputs_.emplace(identity_of(output), place);
    if (!is_new) refuse(place, fmt::format("has the output of {}: {}", before->second, output));
    for (const std::string& file : files_of_cell(listed.command.input))
      inputs_.emplace(identity_of(file), file);
    fabrics_.push_back(std::move(listed));
  }

  std::string path_;
  std::filesystem::path folder_;
  std::vector<ListedFabric> fabrics_;
  std::map<std::string, std::string> outputs_;  ///< places of the list, by identity_of() the file
  std::map<std::string, std::string> inputs_;   ///< files, by the same
};

}  // namespace

Result<std::vector<ListedFabric>> read_fabric_list(const std::string& path) {
  return guarded(path, [&] { return ListReader(path).read(); });
}

}  // namespace selvedge
