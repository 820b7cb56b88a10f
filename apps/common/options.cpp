#include "apps/common/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>

#include "format/base/atomic_file.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

/// A CLI11 check, which returns the fault of a text, or an empty string.
CLI::Validator validator(std::function<std::string(const std::string&)> fault) {
  return CLI::Validator([fault = std::move(fault)](std::string& text) { return fault(text); }, "");
}

/// Splits a text into a number from 0 to 2^64 - 1 and the rest.
std::optional<std::pair<std::uint64_t, std::string>> whole_number(const std::string& text) {
  std::uint64_t number = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc()) return std::nullopt;
  return std::pair(number, std::string(rest, end));
}

}  // namespace

std::uint64_t Options::bytes_from(const char* option, const std::string& text) {
  if (const auto parsed = whole_number(text); parsed && parsed->first > 0) {
    const auto& [number, unit] = *parsed;
    const std::string letter = CLI::detail::to_lower(unit.substr(0, 1));
    const std::string rest = CLI::detail::to_lower(unit.substr(letter.size()));
    const std::size_t power = letter.empty() ? 0 : std::string_view("bkmgt").find(letter);
    const bool is_unit = rest.empty() || (power > 0 && (rest == "b" || rest == "ib"));
    if (power < 5 && is_unit && number <= UINT64_MAX >> (10 * power)) return number << (10 * power);
  }
  refuse(option, fmt::format("\"{}\" is not a number of bytes such as 64K", text));
}

std::string file_identity(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) return fmt::format("{}:{}", status.st_dev, status.st_ino);
  std::error_code ignored;
  const std::filesystem::path whole = std::filesystem::absolute(path, ignored);
  const std::filesystem::path place = std::filesystem::weakly_canonical(whole, ignored);
  return (ignored ? whole.lexically_normal() : place).string();
}

Result<void> check_writable(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (path.empty()) continue;
    if (const auto file = AtomicFile::create(path); !file) return tl::unexpected(file.error());
  }
  return {};
}

void refuse(const std::string& option, const std::string& why) { throw CLI::ValidationError(option, why); }

std::vector<double> parse_number_list(const std::string& option, const std::string& text, char separator,
                                      std::size_t min, std::size_t max, const char* example) {
  const auto parsed = parse_numbers(text, separator, min, max);
  if (!parsed) refuse(option, fmt::format("\"{}\" is not of the form {}", text, example));
  return *parsed;
}

std::vector<int> parse_integer_list(const std::string& option, const std::string& text, char separator,
                                    std::size_t min, std::size_t max, const char* example) {
  std::vector<int> whole;
  for (const double n : parse_number_list(option, text, separator, min, max, example)) {
    if (n != std::floor(n) || std::abs(n) > 1e9)
      refuse(option, fmt::format("\"{}\" is not of the form {}", text, example));
    whole.push_back(static_cast<int>(n));
  }
  return whole;
}

const Option& Option::required(bool is_required) const {
  option_->required(is_required);
  return *this;
}

const Option& Option::in_range(double min, double max) const {
  // A default out of range means "not set" and is not shown.
  double default_value = 0;
  if (CLI::detail::lexical_cast(option_->get_default_str(), default_value) &&
      !(default_value >= min && default_value <= max))
    option_->default_str("");
  option_->check(validator([min, max](const std::string& text) {
    double value = 0;
    const bool good = CLI::detail::lexical_cast(text, value) && value >= min && value <= max;
    return good ? std::string() : fmt::format("{} is not a number in {} to {}", text, min, max);
  }));
  return *this;
}

const Option& Option::ends_in(std::vector<std::string> endings) const {
  option_->check(validator([endings = std::move(endings)](const std::string& file) {
    const auto fits = [&](const std::string& ending) {
      return ending == "-" ? file == "-" : has_ending(file, ending);
    };
    return std::ranges::any_of(endings, fits)
               ? std::string()
               : fmt::format("\"{}\" does not end in {}", file, fmt::join(endings, " or "));
  }));
  return *this;
}

const Option& Option::names_files(FileOption::Use use, bool has_names) const {
  files_->push_back({option_, use, has_names});
  return *this;
}

const Option& Option::excludes(const Option& other) const {
  option_->excludes(other.option_);
  return *this;
}

const Option& Option::advanced() const {
  option_->group(advanced_heading);
  return *this;
}

const Option& Option::word_count(int min, int max) const {
  option_->expected(min, max);
  return *this;
}

Options::Options(CLI::App& app) : app_(app) {
  app_.final_callback([this] {
    check_files();
    for (const auto& each : checks_) each();
  });
}

void Options::check_files() const {
  using Use = FileOption::Use;
  std::map<std::string, std::vector<const FileOption*>> uses;  ///< by identity of the file
  for (const FileOption& file : files_) {
    const std::string name = file.option->get_name();
    for (const std::string& value : file.option->results()) {
      if (file.use == Use::written && value.empty()) refuse(name, "names no file");
      if (file.use == Use::written && value == "-") {
        if (file.option->get_type_name().ends_with("|-")) continue;
        refuse(name, "cannot be standard output; name a file");
      }
      const std::string path = value.substr(file.has_names ? value.find('=') + 1 : 0);
      // Without an ending and a file it is the name of a stitch or an environment, or a colour.
      std::error_code ignored;
      const std::filesystem::path place(path);
      const bool is_name = !place.has_extension() && !std::filesystem::is_regular_file(place, ignored);
      if (file.use != Use::written && is_name) continue;
      std::vector<const FileOption*>& before = uses[file_identity(path)];
      for (const FileOption* other : before) {
        const auto [output, input] =
            file.use == Use::written ? std::pair(&file, other) : std::pair(other, &file);
        const bool in_place = input->use == Use::rewritten && output->option->get_name() == "--output";
        if (output->use != Use::written || in_place) continue;
        refuse(output->option->get_name(),
               fmt::format("{} is the file of {} as well", path, input->option->get_name()));
      }
      before.push_back(&file);
    }
  }
}

Result<void> Options::check_outputs() const {
  for (const FileOption& file : files_) {
    if (file.use != FileOption::Use::written) continue;
    std::vector<std::string> paths = file.option->results();
    // Names of many files, which their verb opens.
    std::erase_if(paths,
                  [](const std::string& path) { return path == "-" || path.find('{') != std::string::npos; });
    if (auto good = check_writable(paths); !good) return good;
  }
  return {};
}

void Options::begin_group(const char* heading) { group_ = *heading == '\0' ? "Options" : heading; }

void Options::common(CommonOptions& common) {
  common_ = &common;
  flag("--json", common.json, "The report, or the error, as JSON on standard output");
  flag("--quiet", common.quiet, "No progress, no table, no remarks");
  number("--threads", common.threads, "N", "0: all cores; the bytes are the same for any number")
      .in_range(0, 4096);
}

Option Options::add(CLI::Option* option, const char* type) {
  option->group(group_);
  if (*type != '\0') option->type_name(type);
  return {option, files_};
}

template <class T>
Option Options::number(const char* name, T& value, const char* type, const std::string& help) {
  CLI::Option* option = app_.add_option(name, value, help)->capture_default_str();
  // CLI11 would convert a negative number to a large one.
  if constexpr (std::is_same_v<T, std::uint64_t>) {
    option->check(validator([](const std::string& text) {
      const auto parsed = whole_number(text);
      const bool good = parsed && parsed->second.empty();
      return good ? std::string() : fmt::format("\"{}\" is not a whole number from 0 to 2^64 - 1", text);
    }));
  }
  return add(option, type);
}
template Option Options::number(const char*, int&, const char*, const std::string&);
template Option Options::number(const char*, float&, const char*, const std::string&);
template Option Options::number(const char*, double&, const char*, const std::string&);
template Option Options::number(const char*, std::uint64_t&, const char*, const std::string&);
template Option Options::number(const char*, std::optional<int>&, const char*, const std::string&);
template Option Options::number(const char*, std::optional<double>&, const char*, const std::string&);

Option Options::size(const char* name, V2i& value, const std::string& help, int min, int max) {
  return text(name, "WxH", fmt::format("{} [{}x{}]", help, value.x, value.y),
              [name, &value, min, max](const std::string& t) {
                const auto n = parse_integer_list(name, t, 'x', 2, 2, "320x240");
                if (std::min(n[0], n[1]) < min || std::max(n[0], n[1]) > max)
                  refuse(name, fmt::format("must lie in {} to {}", min, max));
                value = V2i(n[0], n[1]);
              });
}

Option Options::flag(const char* name, bool& value, const std::string& help) {
  return add(app_.add_flag(name, value, help), "");
}

Option Options::flag(const char* name, std::function<void()> set, const std::string& help) {
  return add(app_.add_flag_callback(name, std::move(set), help), "");
}

Option Options::text(const char* name, std::string& value, const char* type, const std::string& help) {
  return add(app_.add_option(name, value, help)->capture_default_str(), type);
}

Option Options::text(const char* name, const char* type, const std::string& help,
                     const std::function<void(const std::string&)>& read) {
  return add(app_.add_option_function<std::string>(name, read, help), type);
}

template <class T>
Option Options::vector(const char* name, T& value, const char* type, const std::string& help) {
  constexpr bool has_two = std::is_same_v<T, V2d> || std::is_same_v<T, std::optional<V2d>>;
  return text(name, type, help, [name, type, &value](const std::string& t) {
    const auto n = parse_number_list(name, t, ',', has_two ? 2 : 3, has_two ? 2 : 3, type);
    if constexpr (has_two)
      value = V2d(n[0], n[1]);
    else
      value = T(V3d(n[0], n[1], n[2]));
  });
}
template Option Options::vector(const char*, V2d&, const char*, const std::string&);
template Option Options::vector(const char*, V3d&, const char*, const std::string&);
template Option Options::vector(const char*, V3f&, const char*, const std::string&);
template Option Options::vector(const char*, std::optional<V2d>&, const char*, const std::string&);
template Option Options::vector(const char*, std::optional<V3d>&, const char*, const std::string&);

Option Options::choice(const char* name, std::span<const std::string_view> names, const std::string& help,
                       std::function<void(std::size_t)> read) {
  const std::string type = fmt::format("{}", fmt::join(names, "|"));
  return text(name, type.c_str(), help, [name, names, type, read = std::move(read)](const std::string& t) {
    const auto found = std::ranges::find(names, t);
    if (found == names.end()) refuse(name, fmt::format("\"{}\" is not one of {}", t, type));
    read(found - names.begin());
  });
}

Option Options::list(const char* name, std::vector<std::string>& values, const char* type,
                     const std::string& help) {
  return list(name, type, help, [&values](const std::vector<std::string>& texts) { values = texts; });
}

Option Options::list(const char* name, const char* type, const std::string& help,
                     const std::function<void(const std::vector<std::string>&)>& read) {
  CLI::Option* option = app_.add_option_function<std::vector<std::string>>(name, read, help);
  // One value per occurrence of the option; otherwise it would take the following arguments.
  if (*name == '-') option->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  return add(option, type);
}

Option Options::output(std::string& path, const std::string& help, std::vector<std::string> endings) {
  Option option = text("-o,--output", path, "FILE", help);
  option.writes();
  if (!endings.empty()) option.ends_in(std::move(endings));
  return option;
}

void Options::add_check(std::function<void()> check) { checks_.push_back(std::move(check)); }

bool Options::is_given(const char* name) const { return app_.count(name) > 0; }
bool Options::is_declared(const char* name) const { return app_.get_option_no_throw(name) != nullptr; }
std::vector<std::string> Options::given_texts(const char* name) const {
  return is_declared(name) ? app_.get_option(name)->results() : std::vector<std::string>();
}

Result<void> parse_words(const std::function<void(Options&)>& declare, std::vector<std::string> words,
                         const std::string& file, const std::string& place) {
  CLI::App app;
  Options options(app);
  declare(options);
  std::ranges::reverse(words);
  try {
    app.parse(words);
    return {};
  } catch (const CLI::ParseError& error) {
    std::string why = app.remaining().empty() ? error.what() : "unknown option " + app.remaining().front();
    std::replace(why.begin(), why.end(), '\n', ' ');
    return fail(Code::option_out_of_range, file, place, why);
  }
}

std::string Options::given_words() const {
  std::string words;
  for (const CLI::Option* option : app_.get_options()) {
    const bool is_output = std::ranges::any_of(files_, [&](const FileOption& file) {
      return file.option == option && file.use == FileOption::Use::written;
    });
    static constexpr std::array of_run{"--json", "--quiet", "--threads", "--if-changed"};
    if (is_output || std::ranges::find(of_run, option->get_name()) != of_run.end()) continue;
    for (const std::string& text : option->results()) words += option->get_name() + " " + text + "\n";
  }
  return words;
}

std::vector<std::string> Options::given_inputs() const {
  std::vector<std::string> paths;
  std::error_code ignored;
  for (const FileOption& file : files_) {
    if (file.use == FileOption::Use::written) continue;
    for (const std::string& value : file.option->results()) {
      const std::string path = value.substr(file.has_names ? value.find('=') + 1 : 0);
      if (std::filesystem::is_regular_file(path, ignored)) paths.push_back(path);
    }
  }
  return paths;
}

void Options::refuse_all_but(std::initializer_list<const char*> names, const char* why) const {
  for (const CLI::Option* option : app_.get_options()) {
    const std::string name = option->get_name();
    if (option->count() > 0 && std::ranges::find(names, name) == names.end()) refuse(name, why);
  }
}

void Options::refuse_if(bool here, const char* why, std::initializer_list<const char*> names) const {
  for (const char* name : names)
    if (here && is_given(name)) refuse(name, why);
}

}  // namespace selvedge
