#include "apps/selvedge/made_of.h"

#include <filesystem>

#include "format/base/atomic_file.h"
#include "format/base/digest.h"
#include "format/fabric/file.h"
#include "format/fabric/json_parts.h"

namespace selvedge {
namespace {

constexpr const char* make_member = "make";

/// A path for a makefile: spaces, # and : are escaped, $ is doubled.
std::string for_make(const std::string& path) {
  std::string text;
  for (const char c : path) {
    if (c == ' ' || c == '#' || c == ':') text += '\\';
    if (c == '$') text += '$';
    text += c;
  }
  return text;
}

}  // namespace

Result<std::string> digest_of_inputs(const MakeCommand& command) {
  // The folder of a file makes no difference, its name is recorded in the fabric.
  std::string text = "selvedge " SELVEDGE_VERSION "\n" +
                     std::filesystem::path(command.input).filename().string() + "\n" + command.asked;
  for (const std::string& file : files_of_cell(command.input)) {
    const auto bytes = read_file(file);
    if (!bytes) return tl::unexpected(bytes.error());
    text += std::filesystem::path(file).filename().string() + " " + digest_of(*bytes) + "\n";
  }
  return digest_of(text);
}

std::string with_inputs(const std::string& provenance, const std::string& digest) {
  nlohmann::json json = provenance_json(provenance);
  json[make_member] = {{"inputs", digest}};
  return json.dump();
}

std::string without_inputs(const std::string& provenance) {
  nlohmann::json json = provenance_json(provenance);
  json.erase(make_member);
  return json.dump();
}

bool is_up_to_date(const std::string& output, const std::string& digest) {
  const auto reader = FabricReader::open(output);
  if (!reader) return false;
  const nlohmann::json json = provenance_json(reader->header().provenance);
  const auto at = nlohmann::json::json_pointer("/make/inputs");
  return json.contains(at) && json[at] == digest;
}

Result<void> write_depfile(const std::string& path, const MakeCommand& command) {
  std::string text = for_make(command.output) + ":";
  for (const std::string& file : files_of_cell(command.input)) text.append(" ").append(for_make(file));
  return write_file(path, text + "\n");
}

}  // namespace selvedge
