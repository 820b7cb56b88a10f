// Words of a row of a knitting chart or of written instructions.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include "converter/stitch/chart.h"
#include "converter/stitch/chart_rows.h"
#include "converter/stitch/chart_stitches.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

/// Words as they are read, and those that are not.
const std::map<std::string_view, std::string_view> synonyms{
    {"knit", "k"},       {"purl", "p"},       {"slip", "sl"},       {"stitch", "sts"},    {"stitches", "sts"},
    {"st", "sts"},       {"together", "tog"}, {"repeat", "rep"},    {"rows", "row"},      {"rnds", "rnd"},
    {"round", "rnd"},    {"rounds", "rnd"},   {"right", "rs"},      {"wrong", "ws"},      {"through", "to"},
    {"until", "to"},     {"across", "to"},    {"around", "to"},     {"final", "last"},    {"every", "all"},
    {"alt", "all"},      {"other", "all"},    {"into", "in"},       {"alternate", "all"}, {"time", "times"},
    {"yf", "wyif"},      {"front", "wyif"},   {"yb", "wyib"},       {"back", "wyib"},     {"once", "1times"},
    {"twice", "2times"}, {"one", "1"},        {"two", "2"},         {"three", "3"},       {"four", "4"},
    {"five", "5"},       {"six", "6"},        {"p2sso", "pssotwo"}, {"pass", "psso"}};
const Words fillers{"and",  "then",   "of",       "side",     "sides",  "numbered", "following",
                    "foll", "rem",    "remain",   "left",     "before", "end",      "ending",
                    "edge", "with",   "using",    "change",   "join",   "color",    "colour",
                    "yarn", "turn",   "bring",    "purlwise", "pwise",  "for",      "same",
                    "more", "within", "knitwise", "kwise",    "from",   "between",  "remaining"};

constexpr int max_row_number = 1'000'000;

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

void add_word(std::string word, const std::string& text, int line, Tokens& tokens) {
  if (const auto other = synonyms.find(word); other != synonyms.end()) word = other->second;
  if (fillers.contains(word)) return;
  if (word.size() > 1 && word.find_first_not_of("0123456789") + 1 == word.size() && word.ends_with('x'))
    word.replace(word.size() - 1, 1, "times");
  // "sl1-k1-psso", "m1-l", "k1tbl".
  std::string joined = word;
  std::erase(joined, '-');
  const bool is_whole = !advice_for(joined).empty() || find_stitch_item(joined) ||
                        word.find('/') != std::string::npos || word.starts_with("cc");
  const std::size_t digits = std::min(word.find_first_of("0123456789"), word.size());
  const std::size_t rest = std::min(word.find_first_not_of("0123456789", digits), word.size());
  const std::size_t dash = is_whole || word.size() == 1 ? std::string::npos : word.find('-');
  const auto count_of = [&](const std::string& number) {
    return parse_count(number, max_chart_stitches).value_or(-1);
  };
  if (dash != std::string::npos) {
    if (dash > 0) add_word(word.substr(0, dash), text, line, tokens);
    add_word("-", text, line, tokens);
    if (dash + 1 < word.size()) add_word(word.substr(dash + 1), text, line, tokens);
    return;
  }
  if (!is_whole && rest > digits && rest + 1 != word.size() && (digits > 0 || word.ends_with("times"))) {
    add_word(word.substr(0, digits == 0 ? rest : digits), text, line, tokens);
    if (digits > 0) tokens.back().count = count_of(word.substr(digits, rest - digits));
    if (rest < word.size()) add_word(word.substr(rest), text, line, tokens);
    return;
  }
  Token* last = tokens.empty() ? nullptr : &tokens.back();
  if (last != nullptr && word == "-" && !number_of(*last)) return;
  if (last != nullptr && word == "tog" && last->word == "sl") return;
  if (last != nullptr && (word == "tog" || word == "tbl")) {
    last->word += word == "tbl" ? word : fmt::format("{}tog", std::max(std::exchange(last->count, 0), 1));
  } else if (last != nullptr && last->word.find('/') != std::string::npos && is_digit(last->word.back())) {
    last->word += word;
  } else if (last != nullptr && last->count == 0 && find_stitch_item(last->word) && is_digit(word[0]) &&
             word.find_first_not_of("0123456789") == std::string::npos) {
    last->count = count_of(word);
    last->text += " " + word;
  } else {
    tokens.push_back({is_whole ? joined : word, text, 0, line});
  }
}

/// Passes over words that matter to no stitch, then a word of `wanted`.
bool take(const Tokens& tokens, std::size_t& i, const Words& idle, const Words& wanted) {
  while (is_word_at(tokens, i, idle)) ++i;
  const bool found = is_word_at(tokens, i, wanted);
  i += found ? 1 : 0;
  return found;
}

/// Gives a cable that begins here and is spelled out its name: "sl 2 to cn, hold in front, k2, k2 from cn".
void name_cable(Tokens& tokens, std::size_t begin) {
  std::size_t i = begin + 1;
  int held = tokens[begin].count;
  while (is_word_at(tokens, i, {"next", "the"})) ++i;
  if (const auto number = i < tokens.size() ? number_of(tokens[i]) : std::nullopt; held == 0 && number) {
    held = *number;
    ++i;
  }
  const Words needle{"cn", "needle"};
  if (!take(tokens, i, {"next", "sts", "to", "onto", "on", "a", "the", "cable"}, needle)) return;
  const Words holding{",", "hold", "held", "leave", "place", "keep", "it", "in", "at", "to", "the", "-"};
  if (!take(tokens, i, holding, {"wyif", "wyib"})) return;
  const bool in_front = tokens[i - 1].word == "wyif";
  const Words idle{",", "work", "the", "sts", "next"};
  const Words kinds{"k", "p"};
  if (!take(tokens, i, idle, kinds)) return;
  const Token& first = tokens[i - 1];
  if (!take(tokens, i, idle, kinds)) return;
  const Token& last = tokens[i - 1];
  if (!take(tokens, i, {"sts", "the", "on", "cable"}, needle)) return;
  const Token& front = in_front ? last : first;
  const Token& back = in_front ? first : last;
  if (front.word != "k" || last.count != held || first.count < 1) return;
  const std::string name =
      fmt::format("{}/{}{}{}c", front.count, back.count, in_front ? 'l' : 'r', back.word == "p" ? "p" : "");
  if (!find_stitch_item(name)) return;
  tokens[begin] = {name, tokens[begin].text, 0, tokens[begin].line};
  tokens.erase(tokens.begin() + static_cast<std::ptrdiff_t>(begin) + 1,
               tokens.begin() + static_cast<std::ptrdiff_t>(i));
}

}  // namespace

std::string_view advice_for(const std::string& word) {
  static const std::string_view below =
      "is \"k tbl\" (p tbl) in some patterns, \"tuck\" in the row below in others: write which";
  static const std::string_view needle =
      "crosses no cable that is drawn: \"sl 2 to cn, hold in front, k2, k2 from cn\", in front knit, up to 8 "
      "stitches";
  static const std::string_view rows =
      "does not say which rows: \"Rows 5-8: rep rows 1-4\", or \"Rows 5-8: in St st\"";
  static const std::map<std::string_view, std::string_view> advices{
      {"k1b", below},   {"kb", below},      {"p1b", below}, {"pb", below},      {"cn", needle},
      {"onto", needle}, {"needle", needle}, {"work", rows}, {"continue", rows}, {"cont", rows}};
  const auto found = advices.find(word);
  return found != advices.end() ? found->second : std::string_view();
}

std::optional<int> number_of(const Token& token) {
  static const Words endings{"", "st", "nd", "rd", "th"};
  const std::string_view word = token.word;
  const std::size_t digits = std::min(word.find_first_not_of("0123456789"), word.size());
  return endings.contains(word.substr(digits)) ? parse_count(word.substr(0, digits), max_row_number)
                                               : std::nullopt;
}

Tokens tokens_of(const TextLine& line) {
  std::string plain = line.text;
  for (const char* dash : {"\xe2\x80\x93", "\xe2\x80\x94", "\xe2\x88\x92"})
    for (std::size_t i = 0; (i = plain.find(dash)) != std::string::npos;) plain.replace(i, 3, "-");
  for (std::size_t i = 0; (i = plain.find("\xc3\x97")) != std::string::npos;) plain.replace(i, 2, "x");
  Tokens tokens;
  const std::string marks = ",;.:()[]{}*&";
  for (std::size_t i = 0; (i = plain.find_first_not_of(" \t", i)) != std::string::npos;) {
    const std::size_t end = std::min(plain.find_first_of(" \t" + marks, i), plain.size());
    const std::string text = plain.substr(i, std::max<std::size_t>(end - i, 1));
    i += text.size();
    if (text == "s" && !tokens.empty() && tokens.back().word == "*" && plain[i - 2] == '*') continue;  // "*s"
    if (end + text.size() > i) {
      add_word(lower_case(text), text, line.number, tokens);
    } else if (text != "*" || tokens.empty() || tokens.back().word != "*") {  // "**" is a star as any other
      const std::size_t mark = std::string(";.{}").find(text);
      tokens.push_back({mark < 4 ? std::string(1, ",,()"[mark]) : text, text, 0, line.number});
    }
  }
  for (std::size_t i = 0; i < tokens.size(); ++i)
    if (tokens[i].word == "sl") name_cable(tokens, i);
  return tokens;
}

}  // namespace selvedge
