// Options that several verbs take, in the words of CLI11: only the command line includes this.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "apps/selvedge/command_line.h"

namespace selvedge {

/// Numbers as `parse_numbers` reads them; a usage error that shows the example where the text is none of
/// that.
std::vector<double> numbers(const std::string& option, const std::string& text, char separator,
                            std::size_t least, std::size_t most, const char* example);

/// Whole numbers that fit an int; out of their range is the stage's to say.
std::vector<int> whole_numbers(const std::string& option, const std::string& text, char separator,
                               std::size_t least, std::size_t most, const char* example);

/// An option whose text becomes a value while parsing.
CLI::Option* add_text(CLI::App& app, const std::string& name, const std::string& form,
                      const std::string& help, std::function<void(const std::string&)> take);

/// `draws`: the verb has a --seed of its own, because it draws random numbers.
void add_common(CLI::App& app, CommonOptions& common, bool draws = false);
/// Refuses a file whose name ends in none of these: a usage error.
CLI::Validator ends_in(std::vector<std::string> suffixes);
/// For transform(): bytes, also as 64K or 2M (KiB, MiB). Above 0 and below 2^64, else a usage error.
CLI::Validator byte_count();

/// The parameters that --set names, each once: else a usage error.
void take_settings(const std::vector<std::string>& texts, CellOptions& cell);

/// A whole number that is a seed.
CLI::Validator seed_number();
void add_output(CLI::App& app, std::string& output, const char* what, bool required = true);

/// What a cell is made from, how a bake lights it, and how a fabric is fitted.
void add_cell(CLI::App& app, std::string& input, CellOptions& cell);
void add_bake(CLI::App& app, BakeOptions& bake, std::string& pairs_file);
/// Of the bake: bounces, indirect light, ground and the texels' plane.
void add_transport(CLI::App& app, BakeOptions& bake, const char* group);
void add_fit(CLI::App& app, MakeOptions& options, std::string& report);

}  // namespace selvedge
