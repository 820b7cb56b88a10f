#include "apps/selvedge/ask_model.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>

#include "apps/common/scratch_folder.h"
#include "apps/selvedge/query_json.h"
#include "format/base/json_text.h"
#include "format/base/mip.h"

namespace selvedge {
namespace {

/// Calls `visit(pair, level, x, y)` for every value of one set of pairs, in the order of queries and answers.
template <class Visit>
void for_each_value(const PairSamples& truth, int levels, const Visit& visit) {
  for (std::size_t pair = 0; pair < truth.pairs.size(); ++pair) {
    for (int level = 0; level < levels; ++level) {
      for (int y = 0; y < level_size(truth.height, level); ++y) {
        for (int x = 0; x < level_size(truth.width, level); ++x) visit(pair, level, x, y);
      }
    }
  }
}

void write_queries(const std::string& pipe, const std::string& file, int levels,
                   const ByPairKind<PairSamples>& truth, const std::atomic<bool>& unwanted) {
  // A model that ends early fails a write. The signal would end this program; blocked here, it ends with the
  // thread.
  sigset_t broken_pipe;
  sigemptyset(&broken_pipe);
  sigaddset(&broken_pipe, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &broken_pipe, nullptr);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> queries(std::fopen(pipe.c_str(), "we"), &std::fclose);
  if (!queries) return;
  const std::string name =
      nlohmann::json(file).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  const auto text = [](const V3f& d) { return fmt::format("[{},{},{}]", d.x, d.y, d.z); };
  for (const PairSamples& pairs : truth) {
    for_each_value(pairs, levels, [&](std::size_t pair, int level, int x, int y) {
      if (unwanted || std::ferror(queries.get()) != 0) return;
      const DirectionPair& directions = pairs.pairs[pair];
      const std::string query =
          fmt::format(R"({{"op":"evaluate","file":{},"level":{},"texel":[{},{}],"light":{},"view":{}}})"
                      "\n",
                      name, level, x, y, text(directions.light), text(directions.view));
      std::fputs(query.c_str(), queries.get());
    });
  }
}

Result<Shading> shading_from(const std::string& line) {
  const nlohmann::json answer = parse_json(line);
  if (!answer.is_object()) return malformed("", "is not a JSON object");
  if (answer.contains("error")) return malformed("", answer.dump().c_str());
  const auto rgb = answer.find("rgb");
  const auto alpha = answer.find("alpha");
  if (rgb == answer.end() || !rgb->is_array() || rgb->size() != 3)
    return malformed("rgb", "is not three numbers");
  Shading shading;
  for (int c = 0; c < 3; ++c) {
    const nlohmann::json& value = (*rgb)[static_cast<std::size_t>(c)];
    if (!value.is_number() || !std::isfinite(value.get<float>()))
      return malformed("rgb", "is not three numbers");
    shading.radiance[c] = value.get<float>();
  }
  if (alpha == answer.end() || !alpha->is_number() || !(*alpha >= 0 && *alpha <= 1))
    return malformed("alpha", "is not a number from 0 to 1");
  shading.alpha = alpha->get<float>();
  return shading;
}

/// Longest line, bytes: numbers of 9 digits take less than 100, members that are not known may follow.
constexpr std::size_t max_answer = 4096;

/// For the shell.
std::string quoted(const std::string& path) {
  std::string text = "'";
  for (const char c : path) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// The lines of the answers, counted.
class Answers {
 public:
  explicit Answers(std::FILE* file) : file_(file) {}

  Result<Shading> next() {
    ++count_;
    std::string line;
    int byte = std::getc(file_);
    const bool missing = byte == EOF;
    for (; byte != EOF && byte != '\n' && line.size() <= max_answer; byte = std::getc(file_))
      line += static_cast<char>(byte);
    auto shading = missing                    ? malformed("", "is missing")
                   : line.size() > max_answer ? malformed("", "is too long")
                                              : shading_from(line);
    if (shading) return shading;
    Error error = shading.error();
    error.place = fmt::format("answer {}{}{}", count_, error.place.empty() ? "" : ", ", error.place);
    return tl::unexpected(error);
  }

  /// The fault that more than these are; nothing at the end.
  std::optional<Error> surplus() {
    if (std::getc(file_) == EOF) return {};
    return Error{Code::json_malformed, {}, fmt::format("answer {}", count_ + 1), "is one too many"};
  }

 private:
  std::FILE* file_;
  std::size_t count_ = 0;
};

Result<ByPairKind<PairAnswers>> read_answers(Answers answers, int levels,
                                             const ByPairKind<PairSamples>& truth) {
  ByPairKind<PairAnswers> result;
  std::optional<Error> fault;
  for (std::size_t kind = 0; kind < truth.size(); ++kind) {
    for_each_value(truth[kind], levels, [&](std::size_t /*pair*/, int level, int /*x*/, int /*y*/) {
      if (fault) return;
      result[kind].resize(std::max(result[kind].size(), static_cast<std::size_t>(level) + 1));
      if (auto answer = answers.next()) {
        result[kind][static_cast<std::size_t>(level)].push_back(*answer);
      } else {
        fault = answer.error();
      }
    });
  }
  if (!fault) fault = answers.surplus();
  if (fault) return tl::unexpected(*fault);
  return result;
}

}  // namespace

Result<ByPairKind<PairAnswers>> ask_model(const std::string& command, const std::string& file, int levels,
                                          const ByPairKind<PairSamples>& truth) {
  const auto folder = ScratchFolder::create("selvedge-model");
  if (!folder) return tl::unexpected(folder.error());
  const std::string pipe = folder->path() + "/queries";
  if (mkfifo(pipe.c_str(), 0600) != 0) return fail(Code::file_unwritable, pipe, {}, "no pipe can be made");
  std::FILE* answers = popen(fmt::format("(\n{}\n) <{}", command, quoted(pipe)).c_str(), "re");
  if (answers == nullptr) return fail(Code::json_malformed, command, {}, "cannot be run");
  std::atomic<bool> unwanted = false;
  std::atomic<bool> written = false;
  std::thread writer([&] {
    write_queries(pipe, file, levels, truth, unwanted);
    written = true;
  });
  auto result = read_answers(Answers(answers), levels, truth);
  unwanted = true;
  const int status = pclose(answers);
  // A command that has not read all, or that no shell could run, leaves the writer at a pipe without a
  // reader.
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  for (std::array<char, 4096> rest; !written;) {
    if (read(reader, rest.data(), rest.size()) <= 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  writer.join();
  close(reader);
  if (!result || status != 0) {
    Error error = result ? Error{Code::json_malformed, {}, {}, "the command failed"} : result.error();
    error.file = command;
    return tl::unexpected(error);
  }
  return result;
}

}  // namespace selvedge
