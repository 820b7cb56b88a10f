// What the thread of the window's picture does about files.
#include <algorithm>
#include <filesystem>

#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/picture/environment.h"
#include "format/picture/image.h"
#include "viewer/load.h"
#include "viewer/scene/change_fabrics.h"
#include "viewer/show/background.h"

namespace selvedge {

Result<std::string> BackgroundPicture::add(const std::string& path) {
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) {
    const std::vector<std::string> fabrics = fabrics_in(path);
    if (fabrics.empty()) return fail(Code::file_missing, path, {}, "there is no fabric file in this folder");
    for (const std::string& fabric : fabrics) {
      if (offered_.insert(fabric).second) ask(fabric, &BackgroundPicture::offer, soon_);
    }
  } else if (has_ending(path, ".glb") || has_ending(path, ".gltf")) {
    return show_garment(path, path, false);
  } else if (const auto fabric = FabricReader::open(path)) {
    if (wears_nothing()) return put_on(path);
    if (auto good = add_fabric(path); !good) return tl::unexpected(good.error());
    change_ = Change::scene;
    stage_ = Stage::first;
  } else if (const auto read = read_environment(path, {}, limits_.document.memory)) {
    tell([&](PictureNews& news) {
      news.environments.push_back(
          std::make_shared<const Surroundings>(Surroundings{path, *read, divide(*read)}));
    });
  } else {
    return tl::unexpected(has_ending(path, ".exr") ? fabric.error() : read.error());
  }
  return std::string();
}

Result<void> BackgroundPicture::add_fabric(const std::string& path) {
  if (added_.contains(path)) return {};
  if (auto good = picture_->add_fabric(path); !good) return good;
  added_[path] = static_cast<int>(picture_->fabrics().size()) - 1;
  return {};
}

Result<std::string> BackgroundPicture::offer(const std::string& path) {
  Result<OfferedFabric> offered = offer_of(path, limits_.document.memory, asked_);
  if (!offered) return tl::unexpected(offered.error());
  if (asked_) {
    ask(path, &BackgroundPicture::offer, soon_);  // the picture comes first
  } else {
    tell([&](PictureNews& news) { news.offers.push_back(std::move(*offered)); });
  }
  return std::string();
}

bool BackgroundPicture::wears_nothing() const {
  return std::ranges::all_of(fabrics_of(picture_->scene()), [](int fabric) { return fabric < 0; });
}

Result<std::string> BackgroundPicture::put_on(const std::string& path) {
  if (wears_nothing()) {
    const Result<std::string> dressed = tailor_.dress(garment_, path);
    if (!dressed) return tl::unexpected(dressed.error());
    return show_garment(*dressed, name_, true);
  }
  if (auto good = add_fabric(path); !good) return tl::unexpected(good.error());
  std::vector<int> worn = fabrics_of(picture_->scene());
  for (int& fabric : worn) fabric = fabric < 0 ? -1 : added_[path];
  wish_.state.worn.fabrics = worn;
  wish_.state.hidden.clear();
  change_ = Change::scene;
  stage_ = Stage::first;
  ++era_;
  tell([&](PictureNews& news) {
    news.worn = wish_.state.worn;
    news.era = era_;
  });
  return std::string();
}

/// The garment before stays until a picture of the other one is there. `name`: of what the user has opened.
Result<std::string> BackgroundPicture::show_garment(const std::string& path, const std::string& name,
                                                    bool keeps_camera) {
  Result<LoadedScene> scene = load_scene(path, {}, limits_);
  if (!scene) return tl::unexpected(scene.error());
  std::string remarks;
  for (const std::string& remark : scene->scene.remarks) remarks += (remarks.empty() ? "" : "\n") + remark;
  auto picture = ShowPicture::create(std::move(scene->scene), std::move(scene->fabrics));
  if (!picture) return tl::unexpected(picture.error());
  const double aspect = static_cast<double>(wish_.size.x) / wish_.size.y;
  const Result<ShowState> first = (*picture)->first_state({}, aspect);
  if (!first) return tl::unexpected(first.error());
  ShowState state = wish_.state;
  if (!keeps_camera) state.camera = first->camera;
  state.worn = first->worn;
  state.beside.reset();
  state.hidden.clear();
  const int divisor = size_divisor(1e9, first_picture_seconds);
  if (auto good = (*picture)->update(state, Change::scene, wish_.size, divisor, &closes_); !good)
    return tl::unexpected(good.error());
  picture_ = std::move(*picture);
  good_ = wish_.state = std::move(state);
  divisor_ = divisor;
  change_ = Change::none;
  stage_ = Stage::full;
  probes_ = true;
  garment_ = path;
  name_ = name;
  added_.clear();
  ++frames_;
  ++era_;
  full_seconds_ = picture_->draw_seconds() * divisor * divisor;
  show(ShownGarment{name, keeps_camera ? std::nullopt : std::optional(first->camera), first->worn});
  return remarks;
}

namespace {

std::string free_file(const std::string& stem, const char* ending) {
  std::string path;
  std::error_code unknown;
  for (int i = 1; path.empty() || std::filesystem::exists(path, unknown); ++i)
    path = stem + "-" + std::to_string(i) + ending;
  return path;
}

}  // namespace

Result<std::string> BackgroundPicture::write_picture(const std::string& stem) {
  const Frame& frame = picture_->frame();
  Image image{frame.width, frame.height, 3, {}};
  image.pixels.reserve(frame.pixels.size() * 3);
  for (std::size_t i = 0; i < picture_->bytes().size(); ++i) {
    if (i % 4 != 3) image.pixels.push_back(static_cast<float>(picture_->bytes()[i]) / 255);
  }
  const std::string path = free_file(stem, ".png");
  if (const auto good = write_png(path, image, Transfer::keep); !good) return tl::unexpected(good.error());
  return "saved " + path;
}

Result<std::string> BackgroundPicture::write_garment(const std::string& stem) {
  const std::string path = free_file(stem, ".glb");
  Result<std::string> remarks = tailor_.save(garment_, picture_->dressed(), path);
  if (!remarks) return remarks;
  return "saved " + path + (remarks->empty() ? "" : "\n" + *remarks);
}

}  // namespace selvedge
