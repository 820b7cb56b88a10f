#include "converter/stitch/chart_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "converter/stitch/chart.h"
#include "converter/stitch/chart_stitches.h"
#include "format/base/guard.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

/// Words of shaped pieces.
const Words shaping{"bo",       "co",       "bind", "cast",  "inc",    "dec",
                    "increase", "decrease", "each", "shape", "shaping"};

constexpr int max_brackets = 8;  ///< in each other

bool is_yarn(const Token& token) {
  return (is_letter(token.word) || token.word == "mc" || token.word.starts_with("cc")) && token.count == 0;
}
/// The name of a yarn; case matters for letters.
std::string name_of(const Token& token) {
  return is_letter(token.word) ? token.text.substr(0, 1) : token.word;
}

bool begins_stitches(const Token& token) {
  return token.word == "(" || token.word == "[" || token.word == "*" || find_stitch_item(token.word);
}

/// "Row 2 and all WS rows": the rows that a line is for.
struct RowKey {
  std::vector<int> numbers;  ///< 0: the next one
  bool every_second = false;
  bool is_word = false;  ///< it has a word: "Row 1", "3rd row"
  char side = 0;         ///< 'r', 'w', or 'o': knitted in rounds
  std::size_t end = 0;   ///< of its tokens
};

std::optional<RowKey> row_key(const Tokens& tokens, std::size_t begin = 0) {
  RowKey key;
  bool ranges = false;
  std::size_t i = begin;
  bool ends = false;
  for (; i < tokens.size(); ++i) {
    const auto& [word, text, count, line] = tokens[i];
    if (ends && !is_word_at(tokens, i, {"(", ")", "rs", "ws"})) break;  // "Row 1: (WS) K2"
    if (word == ":") {
      ends = true;
    } else if (word == "row" || word == "rnd" || (word == "r" && count > 0)) {
      key.is_word = true;
      if (word == "rnd") key.side = 'o';
      if (count > 0) key.numbers.push_back(count);
    } else if (const auto number = number_of(tokens[i])) {
      const int first = ranges && !key.numbers.empty() ? key.numbers.back() + 1 : *number;
      for (int n = first; n <= *number && key.numbers.size() < max_chart_stitches; ++n)
        key.numbers.push_back(n);
      ranges = false;
    } else if (word == "rs" || word == "ws") {
      if (key.side != 'o') key.side = word[0];
    } else if (word == "all" || word == "even" || word == "odd") {
      key.every_second = true;
      if (key.numbers.empty() && word != "all") key.numbers = {word == "even" ? 2 : 1};
    } else if (is_word_at(tokens, i, {"(", ",", "&", "-", ")", "next", "to", "the"})) {
      ranges = ranges || word == "-" || word == "to";
      if (word == "next") key.numbers = {0};
      if (word == "(") continue;  // it may open a group of stitches
    } else {
      break;
    }
    key.end = i + 1;
  }
  if (key.numbers.empty() && (key.side == 'r' || key.side == 'w')) key.every_second = true;
  if (key.numbers.empty() && key.every_second && key.side == 0) key.numbers = {1}, key.every_second = false;
  // Not "Rows 1 and 2 form the pattern".
  const bool follows = begin > 0 || ends || key.end >= tokens.size() || begins_stitches(tokens[key.end]) ||
                       is_word_at(tokens, key.end, {"work", "rep", "as"}) || is_letter(tokens[key.end].word);
  const bool sound =
      key.is_word ? follows && (!key.numbers.empty() || key.every_second) : ends && key.numbers.size() == 1;
  return sound ? std::optional(key) : std::nullopt;
}

/// Where "[A3 B]", the letters of yarns, begins at the end of a row; else the tokens' size. `letters`: of
/// yarns, which may be called as stitches are, k or p.
std::size_t find_letters(const Tokens& tokens, const std::string& letters) {
  if (tokens.empty() || tokens.back().word != "]") return tokens.size();
  std::size_t begin = tokens.size() - 1;
  for (; begin > 0 && tokens[begin - 1].word != "["; --begin) {
    const std::string& word = tokens[begin - 1].word;
    const bool is_yarn =
        is_letter(word) && ((word != "k" && word != "p") || letters.find(word) != std::string::npos);
    if (!is_yarn && word != "," && !number_of(tokens[begin - 1])) return tokens.size();
  }
  return begin > 0 && begin + 1 < tokens.size() ? begin - 1 : tokens.size();
}

class Parser {
 public:
  Parser(Tokens tokens, bool chart, const FindYarn& find_yarn, std::size_t yarn)
      : tokens_(std::move(tokens)), is_chart_(chart), find_yarn_(find_yarn), yarn_(yarn) {}

  RowParts row() {
    RowParts parts = sequence(0);
    if (next_ < tokens_.size()) refuse("closes no bracket");
    // "Knit."
    if (!is_chart_ && parts.size() == 1 && is_bare_ && parts[0].group.empty()) parts[0].fills_row = true;
    return parts;
  }
  std::size_t yarn() const { return yarn_; }

 private:
  bool is_word(const Words& words, std::size_t ahead = 0) const {
    return is_word_at(tokens_, next_ + ahead, words);
  }
  bool take(const Words& words) {
    const bool found = is_word(words);
    next_ += found ? 1 : 0;
    return found;
  }
  std::optional<int> take_number() {
    const auto number = next_ < tokens_.size() ? number_of(tokens_[next_]) : std::nullopt;
    next_ += number ? 1 : 0;
    return number;
  }
  [[noreturn]] void refuse(const std::string& why) const {
    const Token& token = tokens_[std::min(next_, tokens_.size() - 1)];
    refuse_line(token.line, fmt::format("\"{}\" {}", token.text, why));
  }

  /// "3 times", "x3".
  std::optional<int> times() {
    if (is_word({"x"}) && tokens_[next_].count > 0) return tokens_[next_++].count;
    const std::size_t begin = next_;
    if (take({"x"})) return take_number();
    const auto number = take_number();
    if (number && take({"times", "x"})) return number;
    next_ = begin;
    return std::nullopt;
  }

  /// "3 times", "to end", "to last 2 sts", "across", "all sts". `more`: times beside these.
  bool take_count(RowPart& part, int more) {
    if (const auto count = times()) {
      part.count = *count + more;
      return true;
    }
    if (!take({"to", "all"}) && !is_word({"sts"})) return false;
    const bool last = take({"last"});
    part.stitches_left = take_number().value_or(last ? 1 : -1);
    part.fills_row = true;
    while (take({"sts", "row", "rnd"})) {
    }
    return true;
  }

  /// "sl1, k1, psso".
  void pass_over(RowParts& parts, bool two) {
    const std::size_t n = parts.size();
    const bool slips = n > 1 && parts[n - 2].item.chart_stitch.held != ChartStitch::Held::none &&
                       parts[n - 2].count == (two ? 2 : 1) && parts[n - 1].count == 1;
    const int takes = slips && parts[n - 1].item.made_stitches == 1 ? parts[n - 1].item.taken_loops : 0;
    if (takes < 1 || takes > (two ? 1 : 2))
      refuse("passes no slipped stitch over: \"sl1, k1, psso\", \"sl1, k2tog, psso\" or \"sl2, k1, p2sso\"");
    parts.resize(n - 1);
    parts.back() = {*find_stitch_item(two ? "cdd" : takes == 2 ? "sk2p" : "ssk"), {}};
    set_part_yarn(parts.back(), yarn_);
  }

  /// "k2", "c4f twice", "p to last 2 sts".
  bool take_stitch(RowParts& parts) {
    const auto& [name, text, count, line] = tokens_[next_];
    const auto item = find_stitch_item(name == "sl" && in_front_ ? "slwyif" : name);
    if (!item) return false;
    if (count < 0) refuse(fmt::format("has no count from 1 to {}", max_chart_stitches));
    is_bare_ = count == 0 && (name == "k" || name == "p");
    RowPart part{*item, {}, std::max(count, 1)};
    set_part_yarn(part, yarn_);
    ++next_;
    if (count > 0) take({"sts", "times", "x"});
    if (const auto more = times())
      part.count *= *more;
    else if (item->taken_loops == 1 && item->made_stitches == 1)
      take_count(part, 0);
    parts.push_back(std::move(part));
    return is_joined_ = true;
  }

  /// "k the knits and p the purls", "work sts as they appear".
  bool take_shown(RowParts& parts) {
    const Words kinds{"k", "knits", "p", "purls"};
    const std::size_t named = is_word(kinds, 2) ? 2 : 3;
    const bool names = is_word({"k", "p"}) && is_word({"the", "all"}, 1) && is_word(kinds, named);
    const bool works =
        is_word({"work", "as"}) && std::ranges::any_of(tokens_, [](const Token& token) {
          return Words{"appear", "present", "knits", "set", "established"}.contains(token.word);
        });
    if (!names && !works) return false;
    RowPart part;
    part.item.like_below = names && tokens_[next_ + named].word[0] != tokens_[next_].word[0] ? -1 : 1;
    part.fills_row = true;
    set_part_yarn(part, yarn_);
    while (next_ < tokens_.size() && !is_word({"to"})) ++next_;
    take_count(part, 0);
    parts.push_back(std::move(part));
    return true;
  }

  /// "rep from * to last st"; `star`: where the repeat begins.
  void repeat(RowParts& parts, std::optional<std::size_t> star) {
    while (take({"rep", "*", ","}) || (is_word({"to"}) && is_word({"*"}, 1) && take({"to"}))) {
    }
    const std::size_t begin = star.value_or(0);
    if (parts.size() <= begin) refuse("repeats nothing");
    if (star || parts.back().group.empty()) {
      RowPart group;
      group.group.assign(parts.begin() + static_cast<std::ptrdiff_t>(begin), parts.end());
      parts.resize(begin);
      parts.push_back(std::move(group));
    }
    RowPart& part = parts.back();
    part.fills_row = !take_count(part, 1) || part.fills_row;
  }

  /// "(k2, p2) 3 times".
  void take_bracket(RowParts& parts, int depth) {
    const int line = tokens_[next_++].line;
    RowPart part;
    part.group = sequence(depth + 1);
    if (!take({")", "]"})) refuse_line(line, "a bracket is not closed");
    if (is_word({"in"})) refuse("follows several stitches of one, which are not drawn");
    take_count(part, 0);
    if (!part.group.empty()) parts.push_back(std::move(part));
    is_joined_ = true;
  }

  /// "wyif": of the slipped stitch before it, or from here on; a yarn likewise.
  bool take_yarn(RowParts& parts) {
    const Token& token = tokens_[next_];
    const bool joined = is_joined_ && !parts.empty();
    using Held = ChartStitch::Held;
    if (const bool front = token.word == "wyif"; front || token.word == "wyib") {
      if (joined && parts.back().item.chart_stitch.held != Held::none)
        parts.back().item.chart_stitch.held = front ? Held::yarn_in_front : Held::yarn_behind;
      else
        in_front_ = front;
    } else if (!is_chart_ && is_yarn(token)) {
      const std::size_t yarn = find_yarn_(name_of(token), token.line);
      joined ? set_part_yarn(parts.back(), yarn) : void(yarn_ = yarn);
    } else {
      return false;
    }
    ++next_;
    return true;
  }

  RowParts sequence(int depth) {
    if (depth > max_brackets) refuse("is in too many brackets");
    RowParts parts;
    std::optional<std::size_t> star;
    is_joined_ = false;
    while (next_ < tokens_.size() && !is_word({")", "]"})) {
      if (is_word({"(", "["})) {
        take_bracket(parts, depth);
      } else if (is_word({"*"}) && !star) {
        star = parts.size();
        ++next_;
      } else if (is_word({"*", "rep"})) {
        repeat(parts, std::exchange(star, std::nullopt));
      } else if (is_word({"psso", "pssotwo"})) {
        pass_over(parts, is_word({"pssotwo"}));
        ++next_;
      } else if (is_word({",", ":"}) || (!is_joined_ && number_of(tokens_[next_]) && is_word({"sts"}, 1))) {
        is_joined_ = false;
        next_ += is_word({",", ":"}) ? 1 : 2;  // "(12 sts)"
      } else if (!take({"-", "rs", "ws", "next", "row", "in", "sts", "the"}) && !take_shown(parts) &&
                 !take_stitch(parts) && !take_yarn(parts)) {
        if (is_word(shaping)) refuse(shaped_piece_message);
        if (const auto advice = advice_for(tokens_[next_].word); !advice.empty()) refuse(std::string(advice));
        if (number_of(tokens_[next_]))
          refuse("counts nothing: a count is behind its stitch, or before \"times\"");
        refuse_line(tokens_[next_].line, fmt::format("there is no stitch \"{}\" (there are {})",
                                                     tokens_[next_].text, known_stitches_text));
      }
    }
    if (star && *star < parts.size()) repeat(parts, star);
    return parts;
  }

  Tokens tokens_;
  bool is_chart_ = false;
  const FindYarn& find_yarn_;
  std::size_t next_ = 0;
  std::size_t yarn_ = 0;    ///< in the hand
  bool in_front_ = false;   ///< the yarn, of slipped stitches
  bool is_joined_ = false;  ///< no comma since the last part
  bool is_bare_ = false;    ///< the last stitch is a word alone
};

/// Takes "in St st" for "k", and tells what its rows show: 's', 'r', reversed, or 'g', garter; 0: another
/// row.
char take_plain(Tokens& body) {
  char kind = 0;
  int sts = 0;
  for (const Token& token : body) {
    const std::string& word = token.word;
    if (word == "sts") ++sts;
    if (word == "garter") kind = 'g';
    if (word == "rev" || word == "reverse") kind = 'r';
    if (kind == 0 && (word.starts_with("stockin") || word == "stocking" || (sts == 2 && word == "sts")))
      kind = 's';
    if (!Words{"sts", "garter", "rev", "reverse", "stockinette", "stockinet", "stocking", "work", "continue",
               "cont", "even", "in", ","}
             .contains(word))
      return 0;
  }
  if (kind != 0) body = {{"k", body.front().text, 0, body.front().line}};
  return kind;
}

class Reader {
 public:
  Reader(bool chart, const std::string& letters, const FindYarn& find_yarn, std::vector<std::string>& remarks)
      : is_chart_(chart), letters_(lower_case(letters)), find_yarn_(find_yarn), remarks_(remarks) {}

  /// A line begins a row, continues one, or says what is done with rows.
  void add_line(Tokens tokens) {
    const auto key = row_key(tokens);
    if (key) {
      end_row();
      key_ = key;
      line_ = tokens.front().line;
      tokens.erase(tokens.begin(), tokens.begin() + static_cast<std::ptrdiff_t>(key->end));
    }
    const bool continues =
        is_word_at(tokens, 0, {"rep", "to", "times"}) || std::ranges::any_of(tokens, begins_stitches);
    const bool is_prose =
        is_word_at(tokens, 0, {"cast", "bind", "co", "bo", "note", "notes", "this", "these"});
    if (!key && !is_prose && is_word_at(tokens, 0, shaping))
      refuse_line(tokens[0].line, fmt::format("\"{}\" {}", tokens[0].text, shaped_piece_message));
    if (!key && (!continues || is_prose)) end_row();
    if (key_ || is_word_at(tokens, 0, {"rep"})) body_.insert(body_.end(), tokens.begin(), tokens.end());
    if (!key_) take_repeat();
  }

  std::vector<ReadRow> rows() {
    end_row();
    fill();
    // A width that every row fits: of a row without a repeat, or else of a repeat of all rows between their
    // edges.
    int period = 1;
    int edge = 0;
    const WrittenRow* other = &rows_.begin()->second;
    for (auto& [number, row] : rows_) {
      row.count_stitches();
      if (row.loops_per_repeat == 0 && other->loops_per_repeat != 0) other = &row;
      edge = std::max(edge, row.fixed_loops);
      period = std::min(std::lcm(period, std::max(row.loops_per_repeat, 1)),
                        static_cast<int>(max_chart_stitches) + 1);
    }
    const bool repeats = other->loops_per_repeat > 0;
    if (!repeats) period = other->fixed_loops;
    if (period * rows_.size() > max_chart_stitches) refuse_size();
    edge = repeats ? edge : 0;
    int width = 2 * edge + period;
    int step = repeats ? 1 : 0;
    for (const auto& [number, row] : rows_) {
      for (int k = 0; k < row.loops_per_repeat && !row.fits_width(width); ++k) width += step;
      if (!row.fits_width(width))
        refuse_line(row.line, fmt::format("{}, {}: all rows must fit one number", row.taken_stitches_text(),
                                          other->taken_stitches_text()));
      step = std::lcm(step, row.loops_per_repeat);
    }
    // Edges are read as often as rows are.
    if (width * rows_.size() > 4 * max_chart_stitches) refuse_size();
    std::vector<ReadRow> read;
    std::vector<ChartStitch> below;
    for (const auto& [number, row] : rows_) {
      below = row.stitches(width, below);
      read.push_back({number, row.line, {below.begin() + edge, below.begin() + edge + period}});
      minimise_column_shifts(read.back().stitches);
    }
    if (std::ranges::any_of(rows_, [](const auto& row) { return row.second.side != 'f'; }))
      remarks_.emplace_back(
          "rows are read as they are worked: from the right, and on wrong sides from the back");
    if (const int left = width % period; left > 0)
      remarks_.push_back(
          fmt::format("the repeat of {} stitches is taken, {} at its edges are left out", period, left));
    return read;
  }

  std::vector<ReadRow> rows_alone(const std::vector<TextLine>& lines) {
    std::vector<ReadRow> read;
    const auto try_row = [&](int number, int line, const auto& work) {
      if (!catch_failure(work) && number > 0) read.push_back({number, line, {}});
    };
    const auto end = [&] {
      try_row(key_ && !key_->numbers.empty() ? key_->numbers.front() : 0, line_, [&] { end_row(); });
    };
    for (const TextLine& line : lines) {
      if (row_key(tokens_of(line))) end();
      try_row(0, 0, [&] { add_line(tokens_of(line)); });
    }
    end();
    int width = 0;
    for (auto& [number, row] : rows_) {
      if (row.side == 0) row.side = 'f';
      try_row(0, 0, [&written = row] { written.count_stitches(); });
      width = std::max(width, row.fixed_loops + row.loops_per_repeat);
    }
    for (const auto& [number, row] : rows_)
      try_row(number, row.line, [&, &w = row] { read.push_back({w.number, w.line, w.stitches(width, {})}); });
    std::ranges::sort(read, {}, &ReadRow::number);
    return read;
  }

 private:
  [[noreturn]] void refuse_size() const {
    refuse_line(line_, fmt::format("more than {} stitches in all rows: {}", max_chart_stitches,
                                   cut_to_repeat_advice));
  }

  /// "Repeat rows 3-6": takes it from the end of the row, or, where that has no stitch, the rows that it is
  /// as.
  std::vector<int> take_repeat() {
    for (std::size_t i = 0; i + 1 < body_.size(); ++i) {
      const auto key = row_key(body_, i + 1);
      if (!is_word_at(body_, i, {"rep", "as"}) ||
          (!key && !is_word_at(body_, i + 1, {"these", "this", "last"})))
        continue;
      body_.resize(i);
      const bool has_stitch = std::ranges::any_of(body_, begins_stitches);
      std::erase_if(body_, [](const Token& token) { return token.word == "work"; });
      if (key && key_ && !has_stitch) return key->numbers;
      if (key && !key->numbers.empty()) repeated_ = {key->numbers.front(), key->numbers.back()};
    }
    if (!key_) body_.clear();
    return {};
  }

  void end_row() {
    if (!key_) return;
    const std::vector<int> sources = take_repeat();
    const RowKey key = *std::exchange(key_, std::nullopt);
    Tokens body = std::exchange(body_, {});
    WrittenRow row{0, line_, key.side};
    const std::size_t begin = find_letters(body, letters_);
    for (std::size_t i = begin + 1; i + 1 < body.size(); ++i) {
      if (body[i].word == ",") continue;
      const std::size_t yarn = find_yarn_(name_of(body[i]), line_);
      int count = std::max(body[i].count, 1);
      if (body[i].count == 0 && number_of(body[i + 1])) count = *number_of(body[++i]);
      row.yarns.insert(row.yarns.end(), std::min<std::size_t>(count, max_chart_stitches), yarn);
      if (row.yarns.size() > max_chart_stitches) break;
    }
    yarn_count_ += row.yarns.size();
    if (yarn_count_ > max_chart_stitches) refuse_size();
    body.resize(begin);
    const bool states_yarn = !body.empty();
    if (states_yarn) {
      row.plain = is_chart_ ? '\0' : take_plain(body);
      Parser parser(std::move(body), is_chart_, find_yarn_, yarn_);
      row.parts = parser.row();
      yarn_ = parser.yarn();
    }
    if (sources.empty() && row.parts.empty()) refuse_line(line_, "the row has no stitch");
    for (std::size_t k = 0; k < key.numbers.size(); ++k) {
      row.number = key.numbers[k] > 0 ? key.numbers[k] : rows_.empty() ? 1 : rows_.rbegin()->first + 1;
      if (const int source = sources.empty() ? 0 : sources[k % sources.size()]; source > 0) {
        if (!rows_.contains(source))
          refuse_line(line_, fmt::format("row {} repeats row {}, which is not above it", row.number, source));
        row.parts = rows_.at(source).parts;
        row.plain = rows_.at(source).plain;
        for (RowPart& part : row.parts)
          if (states_yarn) set_part_yarn(part, yarn_);
      }
      if (!rows_.emplace(row.number, row).second)
        refuse_line(line_,
                    fmt::format("row {} is given a second time: keep the rows of one pattern", row.number));
    }
    if (key.every_second) every_second_.push_back(row);
    if (key.every_second && key.numbers.empty()) every_second_.back().number = 0;
  }

  /// Rows that "all WS rows" stands for; then sides, and the rows that are repeated.
  void fill() {
    bool back_is_odd = false;
    bool in_rounds = false;
    bool states_sides = true;
    for (const auto& [number, row] : rows_) {
      if (row.side == 'w') back_is_odd = number % 2 != 0;
      in_rounds = in_rounds || row.side == 'o';
      states_sides = states_sides && row.side != 0;
    }
    if (rows_.empty()) refuse_text("", "has no row");
    int last = std::max(rows_.rbegin()->first, repeated_.second);
    if (!every_second_.empty() && last % 2 != 0) ++last;
    for (WrittenRow& row : every_second_) {
      const int parity = row.number > 0 ? row.number % 2 : (row.side == 'w') == back_is_odd ? 1 : 0;
      for (row.number = 2 - parity; row.number <= last && rows_.size() < max_chart_stitches; row.number += 2)
        rows_.emplace(row.number, row);
    }
    int expected = rows_.begin()->first;
    for (auto& [number, row] : rows_) {
      if (number != expected++)
        refuse_line(row.line, fmt::format("row {} is missing below row {}", expected - 1, number));
      if (row.side == 0)
        row.side = is_chart_ ? 'f' : !in_rounds && (number % 2 != 0) == back_is_odd ? 'w' : 'r';
    }
    const int count = static_cast<int>(rows_.size());
    // Sides alternate: an odd number of rows is worked once from either side.
    const bool doubles = !is_chart_ && !in_rounds && count % 2 != 0 && (!states_sides || repeated_.first > 0);
    for (int k = expected - count; doubles && k < expected; ++k) {
      WrittenRow row = rows_.at(k);
      row.number += count;
      row.side = row.side == 'w' ? 'r' : 'w';
      rows_.emplace(row.number, std::move(row));
    }
    for (auto& [number, row] : rows_) {
      const bool turns =
          row.plain == 'g' ? row.side == 'o' && number % 2 == 0 : (row.side == 'w') == (row.plain == 's');
      if (row.plain != 0 && turns) row.parts.front().item.chart_stitch.purl = true;
    }
    const auto [begin, end] = repeated_;
    if (begin <= rows_.begin()->first || end != rows_.rbegin()->first || begin > end) return;
    remarks_.push_back(fmt::format("rows {} to {} are repeated, those below them are left out", begin, end));
    std::erase_if(rows_, [first = begin](const auto& row) { return row.first < first; });
  }

  bool is_chart_ = false;
  std::string letters_;
  const FindYarn& find_yarn_;
  std::vector<std::string>& remarks_;
  std::map<int, WrittenRow> rows_;
  std::vector<WrittenRow> every_second_;
  std::pair<int, int> repeated_{0, 0};
  std::optional<RowKey> key_;  ///< of the row that is read
  std::size_t yarn_count_ = 0;
  Tokens body_;
  int line_ = 0;
  std::size_t yarn_ = 0;  ///< in the hand
};

}  // namespace

bool begins_row(const std::string& line) { return row_key(tokens_of({0, line})).has_value(); }

bool is_chart(const std::vector<TextLine>& lines) {
  bool has_words = false;
  for (const TextLine& line : lines) {
    const Tokens tokens = tokens_of(line);
    const auto key = row_key(tokens);
    has_words = has_words || (key && key->is_word);
    if (key && find_letters(tokens, "") < tokens.size()) return true;
  }
  return !has_words;
}

std::vector<ReadRow> read_rows(const std::vector<TextLine>& lines, const std::string& letters,
                               const FindYarn& find_yarn, std::vector<std::string>& remarks, bool alone) {
  Reader reader(is_chart(lines), letters, find_yarn, remarks);
  if (alone && is_chart(lines)) return reader.rows_alone(lines);
  for (const TextLine& line : lines) reader.add_line(tokens_of(line));
  return reader.rows();
}

}  // namespace selvedge
