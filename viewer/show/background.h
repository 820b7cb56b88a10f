// The picture of `show`, made on a thread of its own: small at first, then in full, then with more samples,
// so that the window answers at once however long a frame takes.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "format/gltf/limits.h"
#include "viewer/show/picture.h"

namespace selvedge {

/// What a window wants to see.
struct PictureWish {
  ShowState state;
  Change change = Change::none;    ///< since the last wish
  V2i size{1, 1};                  ///< of the picture, pixels
  std::optional<V2d> probed = {};  ///< a point of it, as in ShowPicture::probe()
  int era = 0;  ///< PictureNews::era, on which the state is based; a wish of an older one is dropped
};

/// A picture, and what the panel tells of it and of the scene.
struct ShownPicture {
  int width = 0;
  int height = 0;
  int divisor = 1;                    ///< it is smaller than the wish by so much per side
  std::vector<std::uint8_t> bytes;    ///< in display.h's form
  std::vector<OverlayPixel> overlay;  ///< empty if switched off
  Camera camera;
  std::vector<Light> lights;
  RenderStats stats;
  double draw_seconds = 0;
  double overlay_seconds = 0;
  double display_seconds = 0;
  std::int64_t frames = 0;  ///< drawn so far, samples of pictures at rest not counted
  Issues warnings;
  std::vector<std::string> materials;     ///< names; empty names for those without fabric
  std::vector<std::string> fabric_names;  ///< to choose from
  int levels = 1;  ///< the most that a fabric has, coarser than any that the file leaves out
  std::uint64_t bytes_read = 0;
  std::uint64_t file_bytes = 0;
  double size = 1;  ///< diagonal of the scene, m
};

/// What happened since the last look.
struct PictureNews {
  std::shared_ptr<const ShownPicture> picture;  ///< null: no other than before
  /// What lies at the last point that was probed, PictureWish::probed.
  std::optional<V2d> probed;
  std::optional<PixelProbe> probe;
  /// The state that the window must go on from: of a new scene, or the last good one where another could not
  /// be drawn.
  std::optional<ShowState> state;
  int era = 0;                                      ///< the number of such states so far
  std::shared_ptr<const Surroundings> environment;  ///< that was added; null: none
  std::optional<std::string> message;               ///< an error in one line, or empty: a file was added
  std::optional<Error> failure;                     ///< nothing can be drawn any more
  /// The last wish has its picture in full size, and its probe.
  bool finished = false;
};

class BackgroundPicture {
 public:
  /// Calls `wake` from its thread whenever there is news. `limits` are those of garments that are added.
  BackgroundPicture(std::unique_ptr<ShowPicture> picture, const SceneLimits& limits,
                    std::function<void()> wake);
  /// Ends what is being drawn.
  ~BackgroundPicture();
  BackgroundPicture(const BackgroundPicture&) = delete;
  BackgroundPicture& operator=(const BackgroundPicture&) = delete;

  /// Replaces the wish before; a change ends what is being drawn for that, except its small first picture.
  void set_wish(PictureWish wish);
  /// Adds a fabric or an environment to choose from, or shows another garment.
  void add_file(const std::string& path);
  PictureNews poll();

 private:
  /// What is to be done next for the wish.
  enum class Stage { first, full, samples, rest };

  void run();
  void take(PictureWish wish);
  Result<void> step();
  Result<void> draw(Change change, int divisor, const std::atomic<bool>* interrupted);
  Result<void> probe();
  void add(const std::string& path);
  Result<void> show_garment(const std::string& path);
  void show();
  template <class Change>
  void tell(Change change);

  // Of the window and of the thread, under the mutex.
  std::mutex mutex_;
  std::condition_variable there_is_work_;
  std::optional<PictureWish> next_;
  std::vector<std::string> files_;
  PictureNews news_;
  bool closes_ = false;
  std::atomic<bool> interrupted_{false};

  // Of the thread alone.
  std::unique_ptr<ShowPicture> picture_;
  SceneLimits limits_;
  std::function<void()> wake_;
  PictureWish wish_;
  Change change_ = Change::none;  ///< since the last picture
  int divisor_ = 1;               ///< of the last picture
  int era_ = 0;
  Stage stage_ = Stage::rest;
  bool probes_ = false;            ///< the probe of the wish is still to be made
  std::optional<ShowState> good_;  ///< the last state that could be drawn
  double full_seconds_ = 1e9;      ///< for a picture of full size
  std::int64_t frames_ = 0;
  std::thread thread_;
};

}  // namespace selvedge
