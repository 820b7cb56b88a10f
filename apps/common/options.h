// How a verb declares its options: names, values, help and the checks between them. The help, the man pages
// and the shell completion are printed from the same declarations. Only options.cpp, program.cpp and
// manual.cpp include CLI11.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "apps/common/report.h"
#include "format/base/vec.h"

namespace CLI {  // NOLINT(readability-identifier-naming): that of CLI11
class App;
class Option;
}  // namespace CLI

namespace selvedge {

/// Ends the parsing of a command line: "--option: why" in one line, exit status 2.
[[noreturn]] void refuse(const std::string& option, const std::string& why);

/// An option that has been declared. Each function narrows it down and gives it back.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  const Option& required(bool is_required = true) const;
  /// A number in [min, max], neither NaN nor infinite.
  const Option& in(double min, double max) const;
  /// A file's name with one of these endings.
  const Option& ends_in(std::vector<std::string> endings) const;
  const Option& excludes(const Option& other) const;
  const Option& needs(const Option& other) const;
  /// Another help text.
  const Option& help(const std::string& text) const;
  /// Of a list of words without an option's name: how many there may be.
  const Option& count(int min, int max) const;

 private:
  CLI::Option* option_;
};

/// The options of one verb. A name without dashes is an argument without a name. Values are shown with their
/// defaults in the help; `type` is what stands for a value there, such as "N" or "FILE".
class Options {
 public:
  explicit Options(CLI::App& app) : app_(app) {}
  Options(const Options&) = delete;
  Options& operator=(const Options&) = delete;

  /// The heading in the help over the options that are declared from now on; "": the usual one.
  void group(const char* heading);

  /// --json, --quiet and --threads.
  void common(CommonOptions& common);
  CommonOptions& common() { return *common_; }

  /// int, float, double, std::uint64_t, std::optional<int> or std::optional<double>.
  template <class T>
  Option number(const char* name, T& value, const char* type, const std::string& help);
  /// Bytes above 0, also as 64K or 2M (KiB, MiB).
  Option bytes(const char* name, std::optional<std::uint64_t>& value, const std::string& help);
  /// "32x16", each within [min, max].
  Option size(const char* name, V2i& value, const std::string& help, int min, int max);

  Option flag(const char* name, bool& value, const std::string& help);
  Option flag(const char* name, std::function<void()> set, const std::string& help);
  /// A flag that gives `target` a value.
  template <class T>
  Option set_flag(const char* name, T& target, std::type_identity_t<T> value, const std::string& help) {
    return flag(
        name, [&target, value] { target = value; }, help);
  }
  /// A flag that takes a number only as --name=number, and is `otherwise` alone.
  Option flag(const char* name, int& value, int otherwise, const std::string& help);

  Option text(const char* name, std::string& value, const char* type, const std::string& help);
  /// The text becomes a value while parsing; `read` may refuse() it.
  Option text(const char* name, const char* type, const std::string& help,
              const std::function<void(const std::string&)>& read);
  /// `count` numbers with commas between them.
  Option numbers(const char* name, std::size_t count, const char* type, const std::string& help,
                 std::function<void(const std::vector<double>&)> read);
  /// V2d, V3d or an optional one.
  template <class T>
  Option vector(const char* name, T& value, const char* type, const std::string& help);
  /// Gives `read` the index of one of the names.
  Option choice(const char* name, std::span<const std::string_view> names, const std::string& help,
                std::function<void(std::size_t)> read);
  template <class Enum>
  Option choice(const char* name, std::span<const std::string_view> names, Enum& value,
                const std::string& help) {
    return choice(name, names, help, [&value](std::size_t index) { value = static_cast<Enum>(index); });
  }
  /// May be repeated.
  Option list(const char* name, std::vector<std::string>& values, const char* type, const std::string& help);
  Option list(const char* name, const char* type, const std::string& help,
              const std::function<void(const std::vector<std::string>&)>& read);

  /// -o, --output, with one of the endings unless there are none. Where `piped` is an ending such as
  /// ".fabric.exr", "-" stands for standard output, to which a file with such a name is copied when it is
  /// whole; otherwise "-" is refused.
  Option output(std::string& path, const std::string& help, const char* piped,
                std::vector<std::string> endings = {});
  /// The output's path where that is "-"; else nothing.
  std::string* piped_output() const;
  const std::string& piped_ending() const { return piped_ending_; }

  /// Runs after parsing, in the order of declaration; may refuse() and change values.
  void check(std::function<void()> check);
  /// Whether an option is on the command line.
  bool given(const char* name) const;
  /// Refuses, where `here`, the first of these options that was given, and says why.
  void refuse_if(bool here, const char* why, std::initializer_list<const char*> names) const;

  CLI::App& app() { return app_; }

 private:
  Option add(CLI::Option* option, const char* type);

  CLI::App& app_;
  CommonOptions* common_ = nullptr;
  std::string group_ = "Options";
  std::string* output_ = nullptr;
  std::string piped_ending_;
  std::vector<std::function<void()>> checks_;
};

/// Numbers with `separator` between them, from `min` to `max` of them; refuse()s a text that is not of the
/// form of `example`.
std::vector<double> numbers_from(const std::string& option, const std::string& text, char separator,
                                 std::size_t min, std::size_t max, const char* example);
/// The same for whole numbers that fit an int.
std::vector<int> whole_numbers_from(const std::string& option, const std::string& text, char separator,
                                    std::size_t min, std::size_t max, const char* example);

}  // namespace selvedge
