// The library by its header alone: what SELVEDGE_LIBRARY_ONLY builds and runs.
#include <doctest/doctest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "format/library/selvedge.h"

using namespace selvedge;

TEST_CASE("kept fabrics answer as they did") {
  const std::string folder = SELVEDGE_SOURCE_DIR "/tests/data/kept/4.0/";
  std::ifstream queries(folder + "queries.jsonl");
  std::ifstream answers(folder + "answers.jsonl");
  int asked = 0;
  for (std::string query, answer; std::getline(queries, query) && std::getline(answers, answer);) {
    const auto asks = nlohmann::json::parse(query);
    const auto expected = nlohmann::json::parse(answer);
    if (asks.at("op") != "evaluate" || !asks.contains("uv")) continue;
    CAPTURE(query);
    FabricProblem problem;
    auto fabric = FabricFile::open(folder + asks.at("file").get<std::string>(), &problem);
    CAPTURE(problem.message);
    REQUIRE(fabric);
    if (asks.value("behind", false)) fabric = fabric->turned_over();
    const auto light = asks.at("light").get<std::array<float, 3>>();
    const auto view = asks.at("view").get<std::array<float, 3>>();
    const auto shown = fabric->evaluate_at(asks.at("level").get<double>(), asks.at("uv").at(0).get<double>(),
                                           asks.at("uv").at(1).get<double>(), light, view);
    REQUIRE(shown);
    for (int c = 0; c < 3; ++c)
      CHECK(shown->rgb[c] == doctest::Approx(expected.at("rgb").at(c).get<double>()).epsilon(1e-4));
    CHECK(shown->alpha == doctest::Approx(expected.at("alpha").get<double>()).epsilon(1e-4));
    ++asked;
  }
  CHECK(asked > 20);
}

TEST_CASE("what is no fabric is refused with a reason") {
  const std::string good = SELVEDGE_SOURCE_DIR "/tests/data/kept/4.0/lobes.fabric.exr";
  CHECK(check_fabric_file(good).empty());
  std::ifstream file(good, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const auto whole = std::as_bytes(std::span(bytes));
  CHECK(FabricFile::open(whole, "whole"));
  FabricProblem problem;
  CHECK_FALSE(FabricFile::open(whole.first(bytes.size() / 2), "half", &problem));
  CHECK(problem.code == "FILE_DAMAGED");
  CHECK(problem.file == "half");
  CHECK(problem.is_error);
  CHECK_FALSE(FabricFile::open(SELVEDGE_SOURCE_DIR, &problem));
  CHECK(problem.code == "FILE_UNREADABLE");
  CHECK_FALSE(FabricFile::open(SELVEDGE_SOURCE_DIR "/none.exr", &problem));
  CHECK(problem.code == "FILE_MISSING");
  CHECK(check_fabric_file(SELVEDGE_SOURCE_DIR "/none.exr").front().code == "FILE_MISSING");
}
