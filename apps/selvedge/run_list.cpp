// make --list: makes the fabrics of a list that are not up to date.
#include <fmt/format.h>

#include <filesystem>

#include "apps/selvedge/fabric_list.h"
#include "apps/selvedge/list_page.h"
#include "apps/selvedge/made_of.h"
#include "apps/selvedge/run_make.h"
#include "format/base/printable.h"
#include "format/fabric/file.h"
#include "format/quality/fit_record.h"

namespace selvedge {
namespace {

class ListRun {
 public:
  ListRun(const CommonOptions& common, const ListOptions& list) : common_(common), list_(list) {}

  Result<int> run() {
    const auto fabrics = must(read_fabric_list(list_.path));
    // Before the work: a folder that cannot be made is told at once.
    if (!list_.page.empty()) must(make_folder_of(list_.page + "/pictures/x"));
    if (list_.bakes_parts) {
      bake_parts(fabrics);
    } else {
      for (std::size_t i = 0; i < fabrics.size() && !ends(); ++i) {
        if (is_mine(i)) make(fabrics[i]);
      }
    }
    if (!list_.page.empty()) must(write_list_page(list_.page, list_.path, rows_));
    report(common_, "make",
           {{"list", list_.path},
            {"made", made_},
            {"upToDate", up_to_date_},
            {"failed", failed_},
            {"seconds", seconds_},
            {"fabrics", rows_}},
           fmt::format("{}: {} {}, {} up to date, {} failed, {:.1f} s\n", list_.path, made_,
                       list_.dry_run ? "to make" : "made", up_to_date_, failed_, seconds_));
    return failed_ > 0 ? 1 : 0;
  }

 private:
  bool is_mine(std::size_t index) const {
    return index % static_cast<std::size_t>(list_.task.count) == static_cast<std::size_t>(list_.task.index);
  }
  bool ends() const { return failed_ > 0 && !list_.keep_going; }

  /// Does `work` for a fabric or a part of one, unless it is up to date, and keeps a row about it.
  void work_on(const ListedFabric& fabric, const std::string& output, const std::string& part,
               const std::function<Json(const MakeCommand&)>& work) {
    MakeCommand command = fabric.command;
    command.common = common_;
    command.recorded = true;
    Json row = {{"place", fabric.place}, {"output", output}};
    const auto digest = digest_of_inputs(command);
    std::string state = "made";
    std::string line;
    if (digest && is_up_to_date(command.output, *digest)) {
      state = "upToDate";
      ++up_to_date_;
      line = "up to date";
    } else if (list_.dry_run) {
      state = "toMake";
      ++made_;
      line = command.line + part;
    } else {
      const auto made = guarded(command.output, [&]() -> Result<Json> {
        must(make_folder_of(output));
        return work(command);
      });
      if (made) {
        row.update(*made);
        ++made_;
        seconds_ += row.value("seconds", 0.0);
        line = fmt::format("{} bytes, {:.1f} s", size_of_file(output), row.value("seconds", 0.0));
      } else {
        state = "failed";
        ++failed_;
        row["error"] = to_json(made.error());
        line = "failed";
        if (!common_.json) report_error(made.error());
      }
    }
    row["state"] = state;
    if (state == "made" || state == "upToDate") row.update(figures_of(output));
    row["command"] = command.line + part;
    rows_.push_back(row);
    if (!common_.json && !common_.quiet) fmt::print("{}\n", printable(output + ": " + line));
  }

  /// Bytes of the file, and of a fabric the dB of level 0 on its held-out pairs.
  static Json figures_of(const std::string& output) {
    Json figures = {{"bytes", size_of_file(output)}};
    const auto reader = FabricReader::open(output);
    if (!reader) return figures;
    IssueSink unwanted(output);
    const auto record = fit_record_of(reader->header().provenance, reader->header().levels, unwanted);
    if (record && !record->levels.empty() && record->levels.front().held_out)
      figures["psnr"] = record->levels.front().held_out->psnr;
    return figures;
  }

  static Result<void> make_folder_of(const std::string& path) {
    const auto folder = std::filesystem::path(path).parent_path();
    std::error_code error;
    if (!folder.empty()) std::filesystem::create_directories(folder, error);
    if (error) return fail(Code::file_unwritable, path, "", error.message());
    return {};
  }

  void make(const ListedFabric& fabric) {
    // Tasks of a job array find the parts that other tasks have baked; alone, a whole bake gives the same
    // bytes.
    const bool from_parts = list_.as_task && fabric.shards > 1;
    const std::string shards = from_parts ? fmt::format(" --shards {}", fabric.shards) : "";
    work_on(fabric, fabric.command.output, shards, [&](MakeCommand command) {
      if (from_parts) command.shards = fabric.shards;
      return Json{{"seconds", make_as_asked(command).seconds}};
    });
  }

  void bake_parts(const std::vector<ListedFabric>& fabrics) {
    std::size_t index = 0;
    for (const ListedFabric& fabric : fabrics) {
      for (int i = 0; fabric.shards > 1 && i < fabric.shards; ++i, ++index) {
        if (!is_mine(index) || ends()) continue;
        const BakeShard shard{i, fabric.shards};
        work_on(fabric, part_of(fabric.command, shard), fmt::format(" --shard {}/{}", i, fabric.shards),
                [&](const MakeCommand& command) {
                  const BakeReport baked = bake_part(command, shard);
                  return Json{{"seconds", baked.seconds}};
                });
      }
    }
  }

  const CommonOptions& common_;
  const ListOptions& list_;
  Json rows_ = Json::array();
  int made_ = 0;
  int up_to_date_ = 0;
  int failed_ = 0;
  double seconds_ = 0;
};

}  // namespace

Result<int> run_list(const CommonOptions& common, const ListOptions& list) {
  return ListRun(common, list).run();
}

}  // namespace selvedge
