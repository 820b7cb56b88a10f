// Declares the options of a verb: names, values, help and the checks between them. Help and man pages are
// printed from these declarations. Only options.cpp and program.cpp include CLI11.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "apps/common/report.h"
#include "format/base/vec.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the name is CLI11's
class App;
class Option;
}  // namespace CLI

namespace selvedge {

/// Ends the parsing of a command line: "--option: why" in one line, exit status 2.
[[noreturn]] void refuse(const std::string& option, const std::string& why);

/// An option whose values name files.
struct FileOption {
  /// A rewritten file is read, and --output may be the same file.
  enum class Use { read, rewritten, written };
  const CLI::Option* option;
  Use use;
  bool has_names;  ///< the values are NAME=FILE or FILE
};

/// A declared option. Each function adds a constraint and returns the option.
class Option {
 public:
  Option(CLI::Option* option, std::vector<FileOption>& files) : option_(option), files_(&files) {}

  const Option& required(bool is_required = true) const;
  /// A number in [min, max], neither NaN nor infinite.
  const Option& in_range(double min, double max) const;
  /// A file's name with one of these endings.
  const Option& ends_in(std::vector<std::string> endings) const;
  /// Names files that the verb reads: none of them may be one that it writes, wherever links lead.
  const Option& reads(bool has_names = false) const { return names_files(FileOption::Use::read, has_names); }
  const Option& rewrites() const { return names_files(FileOption::Use::rewritten); }
  /// Names a file that the verb writes; Program checks that it can. Two outputs may not be one file, and
  /// neither "" nor, unless the type ends in "|-", "-" is an output.
  const Option& writes() const { return names_files(FileOption::Use::written); }
  const Option& excludes(const Option& other) const;
  /// Lists the option in --help-all and in the man page alone.
  const Option& advanced() const;
  /// Limits the number of words of a positional list.
  const Option& word_count(int min, int max) const;

 private:
  const Option& names_files(FileOption::Use use, bool has_names = false) const;

  CLI::Option* option_;
  std::vector<FileOption>* files_;
};

/// The options of one verb. A name without dashes declares a positional argument. The help shows defaults;
/// `type` stands for a value there, such as "N" or "FILE".
class Options {
 public:
  explicit Options(CLI::App& app);
  Options& operator=(Options&&) = delete;

  /// Sets the heading in the help for the following options; "": the default heading.
  void begin_group(const char* heading);

  /// --json, --quiet and --threads.
  void common(CommonOptions& common);
  CommonOptions& common() { return *common_; }

  /// int, float, double, std::uint64_t, std::optional<int> or std::optional<double>.
  template <class T>
  Option number(const char* name, T& value, const char* type, const std::string& help);
  /// A positive number of bytes, also as 64K, 2M or 4G (KiB, MiB, GiB).
  template <class T>
  Option bytes(const char* name, T& value, const std::string& help) {
    return text(name, "BYTES", help, [name, &value](const std::string& t) { value = bytes_from(name, t); });
  }
  /// "32x16", each within [min, max].
  Option size(const char* name, V2i& value, const std::string& help, int min, int max);

  Option flag(const char* name, bool& value, const std::string& help);
  Option flag(const char* name, std::function<void()> set, const std::string& help);
  /// A flag that sets `target`.
  template <class T>
  Option set_flag(const char* name, T& target, std::type_identity_t<T> value, const std::string& help) {
    return flag(
        name, [&target, value] { target = value; }, help);
  }

  Option text(const char* name, std::string& value, const char* type, const std::string& help);
  /// A text that `read` converts while parsing; it may refuse() the text.
  Option text(const char* name, const char* type, const std::string& help,
              const std::function<void(const std::string&)>& read);
  /// V2d, V3d, V3f or std::optional of the first two: numbers separated by commas.
  template <class T>
  Option vector(const char* name, T& value, const char* type, const std::string& help);
  /// Calls `read` with the index of one of the names.
  Option choice(const char* name, std::span<const std::string_view> names, const std::string& help,
                std::function<void(std::size_t)> read);
  template <class Enum>
  Option choice(const char* name, std::span<const std::string_view> names, Enum& value,
                const std::string& help) {
    const std::string usual(names[static_cast<std::size_t>(value)]);
    return choice(name, names, help + " [" + usual + "]",
                  [&value](std::size_t index) { value = static_cast<Enum>(index); });
  }
  /// May be repeated.
  Option list(const char* name, std::vector<std::string>& values, const char* type, const std::string& help);
  Option list(const char* name, const char* type, const std::string& help,
              const std::function<void(const std::vector<std::string>&)>& read);

  /// -o, --output, a file with one of the endings if any are given.
  Option output(std::string& path, const std::string& help, std::vector<std::string> endings = {});

  /// Adds a check that runs after parsing, in the order of declaration; it may refuse() and change values.
  void add_check(std::function<void()> check);
  /// Whether an option is on the command line.
  /// Precondition: the option is declared.
  bool is_given(const char* name) const;
  bool is_declared(const char* name) const;
  /// The texts of an option on the command line; none where it is not there or not declared.
  std::vector<std::string> given_texts(const char* name) const;
  /// All words that a result depends on, a line each: without outputs and options of the run.
  std::string given_words() const;
  /// The files that given options name to be read.
  std::vector<std::string> given_inputs() const;
  /// Refuses every given option but these, with the reason `why`.
  void refuse_all_but(std::initializer_list<const char*> names, const char* why) const;
  /// If `here`, refuses the first of these options that is given, with the reason `why`.
  void refuse_if(bool here, const char* why, std::initializer_list<const char*> names) const;

  /// Checks that the files of the options that .writes() declares can be created. FILE_UNWRITABLE.
  Result<void> check_outputs() const;

  CLI::App& app() { return app_; }

 private:
  static std::uint64_t bytes_from(const char* option, const std::string& text);
  Option add(CLI::Option* option, const char* type);
  void check_files() const;

  CLI::App& app_;
  CommonOptions* common_ = nullptr;
  std::string group_ = "Options";
  std::vector<std::function<void()>> checks_;
  std::vector<FileOption> files_;
};

/// Parses words as the command line of a verb that `declare` declares. OPTION_OUT_OF_RANGE, of `place` in
/// `file`.
Result<void> parse_words(const std::function<void(Options&)>& declare, std::vector<std::string> words,
                         const std::string& file, const std::string& place);

/// Parses `min` to `max` numbers separated by `separator`; refuse()s texts of another form than `example`.
std::vector<double> parse_number_list(const std::string& option, const std::string& text, char separator,
                                      std::size_t min, std::size_t max, const char* example);
/// The same for integers in the range of int.
std::vector<int> parse_integer_list(const std::string& option, const std::string& text, char separator,
                                    std::size_t min, std::size_t max, const char* example);

/// The same text for all paths that lead to one file, whether it exists or not.
std::string file_identity(const std::string& path);

/// Checks that each of these files can be created; empty paths are ignored. FILE_UNWRITABLE.
Result<void> check_writable(const std::vector<std::string>& paths);

/// Heading of the options that .advanced() marks.
inline constexpr const char* advanced_heading = "Further options";

}  // namespace selvedge
